//! Builds the struct of a node from its arguments in a graph file, and hides the type of that struct.
use super::{
    Call, CanvasFacts, Context, Fact, FilePath, KindInfo, MaterialInputs, Node, Output, Outputs, TakenChannel,
};
use crate::canonical::canonical;
use crate::diagnostics::Problem;
use crate::value::expression::Growth;
use crate::value::files::FileHandle;
use crate::value::{Canvas, ChannelSet, Stop, Tiling, Type};
use serde::de::value::{SeqDeserializer, StrDeserializer, U32Deserializer};
use serde::de::{DeserializeSeed, Deserializer, Error as _, IntoDeserializer, MapAccess, Visitor};
use std::fmt;
use std::sync::Arc;

/// The value of one field of a node struct.
#[derive(Clone, Debug, PartialEq)]
pub enum Arg<'a> {
    /// A port, connected to the node's input with that index.
    Slot(u32),
    /// A port that takes a list.
    Slots(Vec<u32>),
    /// A parameter, as RON text without references to parameters of the graph.
    Ron(&'a str),
}

/// The reason why a struct cannot be built from its arguments.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildError {
    /// Index of the argument at fault; `None` for the struct as a whole.
    pub arg: Option<usize>,
    /// The error of RON, with the position within the argument's text.
    pub ron: Option<Box<ron::error::SpannedError>>,
    /// The error as a message.
    pub message: String,
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for BuildError {}

impl serde::de::Error for BuildError {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self { arg: None, ron: None, message: message.to_string() }
    }
}

/// A node of any kind.
pub trait DynNode: Send + Sync {
    /// Its parameters that differ from their defaults. Equal parameters give equal bytes.
    fn canonical(&self) -> Vec<u8>;
    /// See [`Node::VERSION`].
    fn version(&self) -> u32;
    /// See [`Node::FACTS`].
    fn facts(&self) -> &'static [Fact];
    /// See [`Node::OUTPUTS`].
    fn outputs(&self) -> &'static [Output];
    /// See [`Node::check`].
    fn check(&self, canvas: &Canvas) -> Vec<Problem>;
    /// See [`Node::advice`].
    fn advice(&self, canvas: &Canvas) -> Vec<Problem>;
    /// See [`Node::tiling`].
    fn tiling(&self, canvas: &Canvas) -> Tiling;
    /// See [`Node::growth`].
    fn growth(&self, canvas: &Canvas, inputs: &[Vec<Growth>]) -> Option<Vec<Growth>>;
    /// See [`Node::whole_bytes`]; at the canvas' resolution.
    fn whole_bytes(&self, canvas: &Canvas) -> u64;
    /// See [`Node::makes_tile`].
    fn makes_tile(&self, port: &str) -> bool;
    /// See [`Node::files`].
    fn files(&self) -> Vec<(&'static str, &FilePath)>;
    /// See [`Node::makes_gray`].
    fn makes_gray(&self, files: &[(&'static str, FileHandle)]) -> bool;
    /// See [`Node::type_of_output`].
    fn type_of_output(&self, inputs: &[(&str, Type)]) -> Result<Type, Vec<Problem>>;
    /// See [`Node::unit`].
    fn unit(&self, output: &Output) -> Option<&'static str>;
    /// See [`Node::takes_udim`].
    fn takes_udim(&self) -> bool;

    /// See [`Node::check_files`].
    fn check_files(&self, files: &[(&'static str, FileHandle)]) -> Vec<Problem>;
    /// See [`Node::channels`].
    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet;
    /// See [`Node::takes`].
    fn takes(&self) -> Vec<TakenChannel>;
    /// See [`Node::distances`].
    fn distances(&self) -> &'static [&'static str];
    /// See [`Node::no_op`].
    fn no_op(&self) -> Option<&'static str>;
    /// See [`Node::no_op_item`].
    fn no_op_item(&self) -> usize;
    /// See [`Node::evaluate`].
    fn evaluate(&self, call: &Call<'_>) -> Result<Outputs, Stop>;
}

impl<T: Node> DynNode for T {
    fn canonical(&self) -> Vec<u8> {
        canonical(self)
    }

    fn version(&self) -> u32 {
        T::VERSION
    }

    fn facts(&self) -> &'static [Fact] {
        T::FACTS
    }

    fn outputs(&self) -> &'static [Output] {
        T::OUTPUTS
    }

    fn check(&self, canvas: &Canvas) -> Vec<Problem> {
        let facts = CanvasFacts::of::<T>(canvas);
        let mut problems = Node::check(self, &facts);
        // The tiling is part of the result, too: this call detects facts that `tiling` reads but that the node does not
        // declare.
        Node::tiling(self, &facts);
        problems.extend(facts.defect(&T::schema_name()));
        problems
    }

    fn advice(&self, canvas: &Canvas) -> Vec<Problem> {
        let facts = CanvasFacts::of::<T>(canvas);
        let mut problems = Node::advice(self, &facts);
        problems.extend(facts.defect(&T::schema_name()));
        problems
    }

    fn tiling(&self, canvas: &Canvas) -> Tiling {
        Node::tiling(self, &CanvasFacts::of::<T>(canvas))
    }

    fn growth(&self, canvas: &Canvas, inputs: &[Vec<Growth>]) -> Option<Vec<Growth>> {
        Node::growth(self, &CanvasFacts::of::<T>(canvas), inputs)
    }

    fn whole_bytes(&self, canvas: &Canvas) -> u64 {
        Node::whole_bytes(self, canvas.resolution, &CanvasFacts::of::<T>(canvas))
    }

    fn makes_tile(&self, port: &str) -> bool {
        Node::makes_tile(self, port)
    }

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        Node::files(self)
    }

    fn makes_gray(&self, files: &[(&'static str, FileHandle)]) -> bool {
        Node::makes_gray(self, files)
    }

    fn type_of_output(&self, inputs: &[(&str, Type)]) -> Result<Type, Vec<Problem>> {
        Node::type_of_output(self, inputs)
    }

    fn unit(&self, output: &Output) -> Option<&'static str> {
        Node::unit(self, output)
    }

    fn takes_udim(&self) -> bool {
        Node::takes_udim(self)
    }

    fn check_files(&self, files: &[(&'static str, FileHandle)]) -> Vec<Problem> {
        Node::check_files(self, files)
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        Node::channels(self, inputs)
    }

    fn takes(&self) -> Vec<TakenChannel> {
        Node::takes(self)
    }

    fn distances(&self) -> &'static [&'static str] {
        Node::distances(self)
    }

    fn no_op(&self) -> Option<&'static str> {
        Node::no_op(self)
    }

    fn no_op_item(&self) -> usize {
        Node::no_op_item(self)
    }

    fn evaluate(&self, call: &Call<'_>) -> Result<Outputs, Stop> {
        let facts = CanvasFacts::of::<T>(call.canvas);
        let outputs = Node::evaluate(self, &Context::new(call, &facts));
        match facts.defect(call.kind) {
            Some(defect) => Err(defect.into()),
            None => outputs,
        }
    }
}

/// A node, or the first invalid argument.
pub type Built = Result<Arc<dyn DynNode>, BuildError>;

/// Builds a node from its arguments. Missing ports keep their defaults.
///
/// # Errors
/// The first invalid argument.
pub fn build<T: Node>(args: &[(&str, Arg<'_>)]) -> Built {
    let node = T::deserialize(Args { args })?;
    Ok(Arc::new(node))
}

/// The options with which all RON text is read.
pub fn ron_options() -> ron::Options {
    use ron::extensions::Extensions as E;
    ron::Options::default()
        .with_default_extension(E::IMPLICIT_SOME)
        .with_default_extension(E::UNWRAP_NEWTYPES)
        .with_default_extension(E::UNWRAP_VARIANT_NEWTYPES)
}

struct Args<'a> {
    args: &'a [(&'a str, Arg<'a>)],
}

impl<'de> Deserializer<'de> for Args<'de> {
    type Error = BuildError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, BuildError> {
        visitor.visit_map(ArgMap { args: self.args, next: 0 })
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

struct ArgMap<'a> {
    args: &'a [(&'a str, Arg<'a>)],
    next: usize,
}

impl<'de> MapAccess<'de> for ArgMap<'de> {
    type Error = BuildError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, BuildError> {
        let Some((name, _)) = self.args.get(self.next) else { return Ok(None) };
        let name: StrDeserializer<'_, BuildError> = (*name).into_deserializer();
        seed.deserialize(name).map(Some).map_err(|e| BuildError { arg: Some(self.next), ..e })
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, BuildError> {
        let index = self.next;
        self.next += 1;
        let Some((_, arg)) = self.args.get(index) else {
            return Err(BuildError::custom("a field has no value"));
        };
        let result = match arg {
            Arg::Slot(slot) => seed.deserialize(Slot(*slot)),
            Arg::Slots(slots) => seed.deserialize(SeqDeserializer::new(slots.iter().map(|s| Slot(*s)))),
            Arg::Ron(text) => return ron_value(seed, text).map_err(|e| BuildError { arg: Some(index), ..e }),
        };
        result.map_err(|e| BuildError { arg: Some(index), ..e })
    }
}

fn ron_value<'de, V: DeserializeSeed<'de>>(seed: V, text: &'de str) -> Result<V::Value, BuildError> {
    let fail = |error: ron::error::SpannedError| BuildError {
        arg: None,
        message: error.code.to_string(),
        ron: Some(Box::new(error)),
    };
    ron_options().from_str_seed(text, seed).map_err(fail)
}

/// Reads the index of a slot, also where an `Option` is expected.
struct Slot(u32);

impl<'de> Deserializer<'de> for Slot {
    type Error = BuildError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, BuildError> {
        visitor.visit_u32(self.0)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, BuildError> {
        visitor.visit_some(U32Deserializer::new(self.0))
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct
        newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

impl IntoDeserializer<'_, BuildError> for Slot {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

/// The functions of a kind.
#[derive(Clone, Copy)]
pub(crate) struct Functions {
    pub(crate) build: fn(&[(&str, Arg<'_>)]) -> Built,
    pub(crate) info: fn(&'static str) -> KindInfo,
}

impl Functions {
    pub(crate) fn of<T: Node>() -> Self {
        Self { build: build::<T>, info: KindInfo::of::<T> }
    }
}
