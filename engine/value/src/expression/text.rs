//! Programs as text, for keys and for transport.
//!
//! A line is a step: `plane` and its number, or the name of an operation, its arguments and, where it has one, its seed.
//! `%` and a number is the result of a step. The last line holds the results.
use super::Op;
use super::builder::{Builder, Scalar, Step};
use super::compiled::{Compiled, Sort};
use super::program::MOST_STEPS;
use std::fmt::Write as _;

/// The most bytes of a text.
const MOST_BYTES: usize = 1 << 20;

/// The last line begins with a mark for the sort of the result.
const MARKS: [(char, Sort); 3] = [('=', Sort::Number), ('?', Sort::Logical), ('*', Sort::Any)];
/// The mark of a word.
const WORD: char = '"';

impl Compiled {
    /// The canonical text of the program. Two expressions that differ only in spaces, in local names, in the order of
    /// definitions or in unused parts have the same text.
    pub fn encode(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, text: &mut String) -> std::fmt::Result {
        for step in &self.steps {
            match step {
                Step::Plane(plane) => write!(text, "plane {plane}")?,
                Step::Op(op, args, seed) => {
                    text.push_str(op.row().word);
                    args[..op.args()].iter().try_for_each(|arg| write_scalar(text, arg))?;
                    if op.is_seeded() {
                        write!(text, " seed {seed}")?;
                    }
                }
            }
            text.push('\n');
        }
        if let Sort::Word(word) = &self.sort {
            return write!(text, "{WORD}{word}");
        }
        text.extend(MARKS.iter().find(|(_, sort)| *sort == self.sort).map(|(mark, _)| mark));
        self.parts.iter().try_for_each(|part| write_scalar(text, part))
    }

    /// The program of a text made by [`encode`](Self::encode); `None` for any other text.
    pub fn decode(text: &str) -> Option<Self> {
        if text.len() > MOST_BYTES {
            return None;
        }
        let mut builder = Builder::default();
        let mut steps = Vec::new();
        let mut rest = text;
        let program = loop {
            if let Some(word) = rest.strip_prefix(WORD) {
                break Self::new(builder, &[], Sort::Word(word.to_owned()));
            }
            if let Some((mark, sort)) = MARKS.iter().find(|(mark, _)| rest.starts_with(*mark)) {
                let parts = rest.strip_prefix(*mark)?.split(' ').skip(1);
                let parts: Vec<Scalar> = parts.map(|part| read_scalar(part, &steps)).collect::<Option<_>>()?;
                if !(1..=4).contains(&parts.len()) || (*sort != Sort::Number && parts.len() != 1) {
                    return None;
                }
                break Self::new(builder, &parts, sort.clone());
            }
            let (line, after) = rest.split_once('\n')?;
            rest = after;
            steps.push(read_step(line, &steps, &mut builder)?);
            if steps.len() > MOST_STEPS {
                return None;
            }
        };
        // Only one text of a program is valid.
        (program.encode() == text).then_some(program)
    }

    /// The number of components of a program's result, by the text that [`encode`](Self::encode) made, if all planes that the
    /// program reads are among `planes`; otherwise `None`, and for the word of a choice. Faster than [`decode`](Self::decode).
    pub fn components_over(text: &str, planes: &dyn Fn(usize) -> bool) -> Option<usize> {
        let (steps, last) = text.rsplit_once('\n').unwrap_or(("", text));
        let mut read = steps.lines().filter_map(|line| line.strip_prefix("plane "));
        let parts = last.strip_prefix(MARKS.map(|(mark, _)| mark))?;
        read.all(|plane| plane.parse().is_ok_and(planes)).then(|| parts.matches(' ').count())
    }
}

fn write_scalar(text: &mut String, part: &Scalar) -> std::fmt::Result {
    match part {
        Scalar::Step(step) => write!(text, " %{step}"),
        // The shortest text that gives the same number.
        Scalar::Known(value) => write!(text, " {value:?}"),
    }
}

/// A number, or the result of one of the steps.
fn read_scalar(word: &str, steps: &[Scalar]) -> Option<Scalar> {
    match word.strip_prefix('%') {
        Some(step) => steps.get(step.parse::<usize>().ok()?).copied(),
        None => Some(Scalar::Known(word.parse().ok()?)),
    }
}

fn read_step(line: &str, steps: &[Scalar], builder: &mut Builder) -> Option<Scalar> {
    let mut words = line.split(' ');
    let name = words.next()?;
    if name == "plane" {
        let plane: u32 = words.next()?.parse().ok()?;
        return words.next().is_none().then(|| builder.plane(plane as usize));
    }
    let op = Op::of_word(name)?;
    let args: Vec<Scalar> = (0..op.args()).map(|_| read_scalar(words.next()?, steps)).collect::<Option<_>>()?;
    let seed = match words.next() {
        Some("seed") if op.is_seeded() => words.next()?.parse().ok()?,
        None if !op.is_seeded() => 0,
        _ => return None,
    };
    words.next().is_none().then(|| builder.make(op, &args, seed))
}
