//! The canvas as a node sees it: only the facts that the node declares.
use super::{Fact, Node};
use crate::diagnostics::{Code, Problem};
use crate::value::{Canvas, Grid, Tiling};
use glam::{DVec2, UVec2};
use std::sync::atomic::{AtomicU8, Ordering};

/// The facts of the canvas that a node declares in [`Node::FACTS`].
///
/// The key of a result holds only the declared facts, so reading another fact would give different results under one
/// key. Therefore an undeclared fact reads as a value that does not depend on the canvas (a size of 1 mm, no tiling,
/// the seed 0), and the engine reports the defect in place of the result. The resolution is not among the facts:
/// results must not depend on it.
#[derive(Debug)]
pub struct CanvasFacts {
    canvas: Canvas,
    declared: &'static [Fact],
    /// The facts that were read without being declared, a bit for each.
    misread: AtomicU8,
}

impl CanvasFacts {
    /// The view that a node of the kind `T` has of a canvas.
    pub fn of<T: Node>(canvas: &Canvas) -> Self {
        Self { canvas: *canvas, declared: T::FACTS, misread: AtomicU8::new(0) }
    }

    fn read<T>(&self, fact: Fact, value: T, instead: T) -> T {
        if self.declared.contains(&fact) {
            return value;
        }
        self.misread.fetch_or(1 << fact as u8, Ordering::Relaxed);
        instead
    }

    /// Its size in mm.
    pub fn size_mm(&self) -> DVec2 {
        self.read(Fact::Size, self.canvas.size_mm, DVec2::ONE)
    }

    /// The directions in which the result must repeat.
    pub fn tile(&self) -> Tiling {
        self.read(Fact::Tile, self.canvas.tile, Tiling::NONE)
    }

    /// The seed of all random numbers.
    pub fn seed(&self) -> u64 {
        self.read(Fact::Seed, self.canvas.seed, 0)
    }

    /// The grid of a picture of the whole canvas at `resolution`.
    pub fn grid(&self, resolution: UVec2) -> Grid {
        Canvas { size_mm: self.size_mm(), ..self.canvas }.grid(resolution)
    }

    /// The defect to report if the node has read a fact that it does not declare.
    pub fn defect(&self, kind: &str) -> Option<Problem> {
        let misread = self.misread.load(Ordering::Relaxed);
        let fact = Fact::ALL.into_iter().find(|fact| misread & (1 << *fact as u8) != 0)?;
        let message = format!("`{kind}` reads {} of the canvas, which it does not declare", fact.name());
        Some(Problem::new(Code::BadValue, message).help("this is a defect of the node"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::{Evaluator, Field, Stop, Tile, Type, Window};
    use crate::{Call, Context, DynNode, Output, Outputs};
    use schemars::JsonSchema;
    use serde::{Deserialize, Serialize};

    /// Reads the given facts, and declares the size and the seed.
    #[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
    struct Curious {
        reads: Vec<String>,
        tiles: bool,
    }

    impl Node for Curious {
        const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "What it read.")];
        const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

        fn advice(&self, canvas: &CanvasFacts) -> Vec<Problem> {
            let advice = Problem::new(Code::Advice, format!("{:?}", canvas.size_mm()));
            vec![advice]
        }

        fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
            if self.tiles { canvas.tile() } else { Tiling::BOTH }
        }

        fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
            let mut sum = 0.0;
            for fact in &self.reads {
                sum += match fact.as_str() {
                    "size" => cx.size_mm().x + cx.canvas.grid(UVec2::splat(2)).step.y,
                    "tile" => f64::from(u8::from(cx.tiling().x)),
                    _ if cx.seed(0) == 7 => 1.0,
                    _ => 0.0,
                };
            }
            #[expect(clippy::cast_possible_truncation, reason = "a test value")]
            let value = sum as f32;
            if value > 1000.0 {
                return Err(Problem::new(Code::BadValue, "too large").into());
            }
            Ok(Outputs::one(Field::constant(Type::Gray, &[value])))
        }
    }

    struct Nothing;

    impl Evaluator for Nothing {
        fn raster(&self, _field: &Field, _grid: &Grid, _window: Window) -> Result<Tile, Stop> {
            Err(Stop::Cancelled)
        }
        fn check(&self) -> Result<(), Stop> {
            Ok(())
        }
        fn progress(&self, _done: u64, _total: u64) {}
        fn memory(&self) -> u64 {
            0
        }
        fn warn(&self, _problem: Problem) {}
    }

    fn canvas(size: f64) -> Canvas {
        Canvas { size_mm: DVec2::splat(size), resolution: UVec2::splat(8), tile: Tiling::BOTH, seed: 3 }
    }

    fn evaluate(reads: &[&str], size: f64) -> Result<f32, String> {
        let node = Curious { reads: reads.iter().map(ToString::to_string).collect(), tiles: false };
        let canvas = canvas(size);
        let call = Call { kind: "Curious", canvas: &canvas, inputs: &[], files: &[], evaluator: &Nothing };
        match DynNode::evaluate(&node, &call) {
            Ok(outputs) => match outputs.take("value", true) {
                Some(crate::value::Value::Field(field)) => Ok(field.as_constant().map_or(f32::NAN, |values| values[0])),
                other => panic!("{other:?}"),
            },
            Err(Stop::Failed(problem)) => Err(format!("{}; {}", problem.message, problem.help.unwrap_or_default())),
            Err(Stop::Cancelled) => panic!("cancelled"),
        }
    }

    #[test]
    fn declared_facts_are_read() {
        assert_eq!(evaluate(&["size"], 16.0), Ok(24.0));
        assert_eq!(evaluate(&["size", "seed"], 20.0), Ok(30.0));
    }

    #[test]
    fn reports_undeclared_facts_as_defects_of_the_node() {
        let defect =
            "`Curious` reads the tiling of the canvas, which it does not declare; this is a defect of the node";
        assert_eq!(evaluate(&["tile"], 16.0), Err(defect.into()));
        // The defect replaces all other errors of the node.
        assert_eq!(evaluate(&["size", "tile"], 1e6), Err(defect.into()));
        assert_eq!(evaluate(&["size"], 1e6), Err("too large; ".into()));
    }

    #[test]
    fn checks_facts_that_the_tiling_reads() {
        let node = |tiles| Curious { reads: Vec::new(), tiles };
        assert_eq!(DynNode::check(&node(false), &canvas(16.0)), []);
        let problems = DynNode::check(&node(true), &canvas(16.0));
        assert!(problems.len() == 1 && problems[0].message.contains("the tiling of the canvas"), "{problems:?}");
        assert_eq!(DynNode::tiling(&node(true), &canvas(16.0)), Tiling::NONE, "the canvas tiles, which it cannot know");
        assert_eq!(DynNode::advice(&node(true), &canvas(16.0)).len(), 1);
    }
}
