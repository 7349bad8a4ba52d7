//! [`Expression`]: a formula for every pixel.
//!
//! The language is that of parameters, see [`expression`](shibo_value::expression); the formula is parsed once and run on blocks of
//! pixels, see [`kernel::expression`](shibo_kernel::pointwise::expression). Inputs that are numbers are constants of the formula, and
//! fields that the result does not need are not computed. Cost: O(pixels), 0.1 to 0.2 ns for each operation, 1 to 4 ns for angles,
//! powers, logarithms and noise.
use super::formula::{InFormula, PLACES, PORTS, Port, growth};
use glam::DVec2;
use shibo_kernel::pointwise::expression as kernel;
use shibo_node::{CanvasFacts, Context, EveryField, Fact, Formula, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::expression::{self, Compiled, Fault, Program};
use shibo_value::{Cost, Field, FieldSource, Given, Grid, Read, Stop, Tile, Tiling, Type, Window};

/// Computes a formula for every pixel, from up to four fields and the position.
///
/// Names in the formula are the ports that are connected, `a`, `b`, `c` and `d`; the position `x`, `y` in mm; `u`, `v`, which go
/// from 0 to 1 across the canvas; `canvas.width`, `canvas.height`, `canvas.seed`; and `$name`, a parameter of the graph. Components are
/// `a.r`, `a.g`, `a.b` of a colour, `a.x`, `a.y` of a vector, `a.xx`, `a.xy`, `a.yx`, `a.yy` of a `Jacobian`. Arithmetic with colours goes
/// component by component, and `"(e1, e2, e3)"` makes a colour. The result is `Gray`, `Vec2`, `Rgb` or `Jacobian`
/// for one to four components. A normal counts as what is kept of it, ½ + ½n.
///
/// Operators, from the loosest to the tightest: `||`, `&&`, `< <= > >= == !=`, `+ -`, `* / %`, `-` and `!` in front, `^`. `%` has the sign
/// of the divisor, `^` groups from the right. Functions: `if(c, a, b)`, `min`, `max`, `clamp(x, lo, hi)`, `mix(a, b, t)`,
/// `smoothstep(e0, e1, x)`, `step(edge, x)`, `abs`, `sign`, `floor`, `ceil`, `round`, `fract`, `sqrt`, `pow`, `exp`, `log`, `sin`, `cos`, `tan`,
/// `asin`, `acos`, `atan`, `atan2(y, x)`, `length`, `random(i)` and `hash(…)` in 0..1, `noise(x, y)` with cells of size 1 in 0..1, and
/// `pi`. Angles are degrees. Where the result is not finite it is 0, with a warning that names a place.
///
/// The result tiles where the inputs do and the position repeats: `sin(360 * 4 * u)`, `fract(4 * u)`, `x % 5` on a canvas of 40 mm, and
/// `noise(8 * u, 8 * v)`; but not `x` or `u` by themselves, which jump at the edge.
///
/// ```ron
/// "bumps": Perlin(size: 16),
/// "example": Expression(
///   a: "bumps",
///   formula: "mix((0.02, 0.06, 0.14), (0.9, 0.5, 0.16), smoothstep(-0.1, 0.1, sin(360 * (5 * u + 3 * a)) + cos(360 * (5 * v - 3 * a))))",
/// ),
/// ```
///
/// Elsewhere: Substance Designer *Pixel Processor* and *Function Graph*, Material Maker *Math*, Blender *Math* and *Vector Math*, Houdini
/// *Attribute VOP* and VEX, GLSL.
#[node]
pub struct Expression {
    /// The field that is called `a` in the formula.
    pub a: Option<In<EveryField>>,
    /// The field that is called `b` in the formula.
    pub b: Option<In<EveryField>>,
    /// The field that is called `c` in the formula.
    pub c: Option<In<EveryField>>,
    /// The field that is called `d` in the formula.
    pub d: Option<In<EveryField>>,
    /// What is computed; must be given.
    pub formula: Formula,
    /// Another seed gives other random numbers and another noise.
    pub seed: u64,
}

impl Expression {
    fn ports(&self) -> [&Option<In<EveryField>>; 4] {
        [&self.a, &self.b, &self.c, &self.d]
    }

    fn compile(&self, ports: [Port; 4], size: DVec2, canvas_seed: u64) -> Result<Compiled, Vec<Fault>> {
        // As in parameters, an equals sign may stand before it.
        let text = &self.formula.0;
        let signed = text.trim_start().starts_with('=') && !text.trim_start().starts_with("==");
        let text = if signed { text.replacen('=', " ", 1) } else { text.clone() };
        expression::compile(&text, &mut InFormula { ports, size, canvas_seed, seed: self.seed })
    }

    /// The formula while nothing is known of what is connected.
    fn outline(&self, size: DVec2, canvas_seed: u64) -> Result<Compiled, Vec<Fault>> {
        let ports = self.ports().map(|port| if port.is_some() { Port::Something } else { Port::Open });
        self.compile(ports, size, canvas_seed)
    }
}

fn located(fault: Fault) -> Problem {
    let problem = Problem::new(fault.code, fault.message).at("formula").within(fault.range);
    Problem { help: fault.help, ..problem }
}

fn problems(faults: Vec<Fault>) -> Vec<Problem> {
    faults.into_iter().map(located).collect()
}

/// The type of a field of so many components.
fn type_of(components: usize) -> Type {
    match components {
        1 => Type::Gray,
        2 => Type::Vec2,
        3 => Type::Rgb,
        _ => Type::Jacobian,
    }
}

impl Node for Expression {
    const OUTPUTS: &'static [Output] = &[Output::told("result", "The value of the formula.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        if self.formula.0.trim().is_empty() {
            let help = "write `formula: \"…\"`, for example \"a * 2 + x\"";
            return vec![Problem::new(Code::MissingInput, "`formula` is not given").at("formula").help(help)];
        }
        match self.outline(canvas.size_mm(), canvas.seed()) {
            Err(faults) => problems(faults),
            Ok(compiled) => {
                let program = compiled.program(&growth(canvas.size_mm()), [canvas.tile().x, canvas.tile().y]);
                program.err().into_iter().map(located).collect()
            }
        }
    }

    fn advice(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let Ok(compiled) = self.outline(canvas.size_mm(), canvas.seed()) else { return Vec::new() };
        let planes = compiled.planes();
        let channels = |index: usize| PLACES.len() + 4 * index..PLACES.len() + 4 * (index + 1);
        let is_read = |index: usize| planes.iter().any(|plane| channels(index).contains(plane));
        let idle =
            PORTS.iter().zip(self.ports()).enumerate().filter(|(index, (_, port))| port.is_some() && !is_read(*index));
        idle.map(|(_, (name, _))| Problem::new(Code::Advice, format!("the formula does not use `{name}`")).at(*name))
            .collect()
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        let repeats =
            self.outline(canvas.size_mm(), canvas.seed()).map(|formula| formula.repeats(&growth(canvas.size_mm())));
        let [x, y] = repeats.unwrap_or([true; 2]);
        canvas.tile().and(Tiling { x, y })
    }

    fn type_of_output(&self, inputs: &[(&str, Type)]) -> Result<Type, Vec<Problem>> {
        let ports = PORTS.map(|name| {
            let given = inputs.iter().find(|(port, _)| *port == name);
            given.map_or(Port::Open, |(_, ty)| Port::Field(ty.channels()))
        });
        self.compile(ports, DVec2::ONE, 0).map(|compiled| type_of(compiled.components())).map_err(problems)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let mut fields = Vec::new();
        for port in self.ports() {
            fields.push(cx.get_opt(port)?);
        }
        let ports = std::array::from_fn(|index| match &fields[index] {
            None => Port::Open,
            Some(field) => match field.as_constant() {
                Some(values) => Port::Constant(values.iter().map(|value| f64::from(*value)).collect()),
                None => Port::Field(field.channels()),
            },
        });
        let size = cx.size_mm();
        let failed = |faults: Vec<Fault>| problems(faults).into_iter().next().map_or(Stop::Cancelled, Stop::from);
        let compiled = self.compile(ports, size, cx.canvas.seed()).map_err(failed)?;
        let ty = type_of(compiled.components());
        let tile = cx.tiling();
        let program = compiled.program(&growth(size), [tile.x, tile.y]).map_err(located)?;
        let [x, y] = compiled.repeats(&growth(size));
        Ok(Outputs::one(Source::field(program, fields, size, ty, tile.and(Tiling { x, y }))))
    }
}

/// Where the values of a plane come from.
#[derive(Clone, Copy, Debug)]
enum Plane {
    /// The position: along which axis, and how many mm are 1.
    Place(usize, f64),
    /// A channel of one of the fields.
    Channel(usize, usize),
}

struct Source {
    program: Program,
    planes: Vec<Plane>,
    fields: Vec<Field>,
}

impl Source {
    /// The field of a program, which tiles as `tiling` and the fields that it reads do.
    fn field(program: Program, fields: Vec<Option<Field>>, size: DVec2, ty: Type, mut tiling: Tiling) -> Field {
        if program.planes.is_empty() {
            let mut values = vec![[0.0]; program.results.len()];
            let mut out: Vec<&mut [f32]> = values.iter_mut().map(|value| value.as_mut_slice()).collect();
            kernel::run(&program, &[], &mut out);
            return Field::constant(ty, &values.concat());
        }
        let mut read: Vec<(usize, Field)> = Vec::new();
        let mut planes = Vec::new();
        for &plane in &program.planes {
            let (port, channel) = match plane {
                0 | 1 => {
                    planes.push(Plane::Place(plane, 1.0));
                    continue;
                }
                2 | 3 => {
                    planes.push(Plane::Place(plane - 2, size[plane - 2]));
                    continue;
                }
                _ => ((plane - PLACES.len()) / 4, (plane - PLACES.len()) % 4),
            };
            let known = read.iter().position(|(known, _)| *known == port);
            let index = known.or_else(|| {
                let field = fields.get(port)?.clone()?;
                tiling = tiling.and(field.tiling());
                read.push((port, field));
                Some(read.len() - 1)
            });
            planes.push(Plane::Channel(index.unwrap_or(0), channel));
        }
        let fields = read.into_iter().map(|(_, field)| field).collect();
        Field::new(ty, tiling, Self { program, planes, fields })
    }
}

impl FieldSource for Source {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.fields.iter().map(|field| Read::new(field, grid, window)).collect()
    }

    #[expect(clippy::cast_possible_truncation, reason = "fields hold f32")]
    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (grid, window, width) = (out.grid, out.window, out.width());
        let place = |axis: usize, unit: f64| {
            let at = |i: usize| {
                let i = i32::try_from(i).unwrap_or(i32::MAX);
                (grid.center(window.x + i, window.y + i)[axis] / unit) as f32
            };
            match axis {
                0 => (0..width).map(at).collect::<Vec<_>>().repeat(out.height()),
                _ => (0..out.height()).flat_map(|row| std::iter::repeat_n(at(row), width)).collect(),
            }
        };
        let made: Vec<Vec<f32>> = self
            .planes
            .iter()
            .map(|plane| match plane {
                Plane::Place(axis, unit) => place(*axis, *unit),
                Plane::Channel(..) => Vec::new(),
            })
            .collect();
        let planes: Vec<&[f32]> = self
            .planes
            .iter()
            .zip(&made)
            .map(|(plane, made)| match plane {
                Plane::Place(..) => made.as_slice(),
                Plane::Channel(field, channel) => given.tile(*field).plane(*channel),
            })
            .collect();
        let bad = kernel::run(&self.program, &planes, &mut out.planes_mut());
        if let Some(pixel) = bad {
            let [x, y] = [pixel % width, pixel / width].map(|i| i32::try_from(i).unwrap_or(0));
            let at = grid.center(window.x + x, window.y + y);
            let message =
                format!("the formula is not finite at x = {:.3}, y = {:.3} mm; it counts as 0 there", at.x, at.y);
            let help = "look for a division by 0, or a root or logarithm of a negative number";
            given.warn(Problem::new(Code::Advice, message).at("formula").help(help));
        }
        Ok(())
    }

    fn cost(&self) -> Cost {
        Cost::Pointwise
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, part, rgb};
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, port};
    use shibo_value::Value;

    fn node(formula: &str, inputs: usize) -> Expression {
        let port = |n: usize| (n < inputs).then(|| port(u32::try_from(n).unwrap()));
        Expression { a: port(0), b: port(1), c: port(2), d: port(3), formula: Formula(formula.to_owned()), seed: 0 }
    }

    fn result(formula: &str, inputs: &[Field]) -> Field {
        let node = node(formula, inputs.len());
        let inputs: Vec<Value> = inputs.iter().cloned().map(Value::from).collect();
        conforms(&node, &inputs);
        field(&node, &inputs, "result")
    }

    fn values(field: &Field) -> Vec<f32> {
        part(field, &canvas(), 0, 0, 64, 64).data().to_vec()
    }

    fn number(value: f32) -> Field {
        Field::constant(Type::Gray, &[value])
    }

    #[test]
    fn formulas_are_computed_for_every_pixel() {
        let (a, b) = (values(&gray()), values(&rgb()));
        let found = values(&result("if(a > 0.5, 2 * a, -a) + c", &[gray(), number(0.0), number(3.0)]));
        assert!(a.iter().zip(found).all(|(a, f)| f == if *a > 0.5 { 2.0 * a } else { -a } + 3.0));
        let mixed = values(&result("a * b + (1, 2, 3)", &[gray(), rgb()]));
        assert!(mixed.iter().enumerate().all(|(k, f)| *f == a[k % 4096] * b[k] + (1 + k / 4096) as f32));
        let parts = result("(a.b - a.r, length(a))", &[rgb()]);
        assert_eq!(parts.ty(), Type::Vec2);
        let parts = values(&parts);
        for k in 0..4096 {
            let [r, g, blue] = [b[k], b[4096 + k], b[8192 + k]];
            assert_eq!(parts[k], blue - r);
            assert!((parts[4096 + k] - (r * r + g * g + blue * blue).sqrt()).abs() < 1e-5);
        }
    }

    #[test]
    fn positions_are_millimetres_and_shares_of_the_canvas() {
        let found = values(&result("(x, y, u - v)", &[]));
        let at = |channel: usize, x: usize, y: usize| found[channel * 4096 + y * 64 + x];
        assert_eq!((at(0, 0, 5), at(0, 63, 0)), (0.25, 31.75));
        assert_eq!((at(1, 3, 0), at(1, 3, 63)), (0.25, 31.75));
        assert!((at(2, 32, 0) - 0.5).abs() < 1e-6);
        let outside = part(&result("x + y", &[]), &canvas(), -2, 64, 1, 1);
        assert_eq!(outside.data(), [-0.75 + 32.25]);
    }

    #[test]
    fn constants_stay_constant() {
        assert_eq!(result("a ^ 2 + canvas.width", &[number(3.0)]).as_constant(), Some(&[41.0][..]));
        assert_eq!(result("= (1, 2) * 3", &[]).as_constant(), Some(&[3.0, 6.0][..]));
        assert_eq!(result("0 * random(2) + 1 / 0", &[]).as_constant(), Some(&[0.0][..]));
    }

    #[test]
    fn tells_where_it_tiles() {
        let tiling = |formula: &str| {
            let tiling = node(formula, 0).tiling_on(&canvas());
            [tiling.x, tiling.y]
        };
        for (formula, expected) in [
            ("1", [true, true]),
            ("x", [false, true]),
            ("v * 2", [true, false]),
            ("sin(360 * 3 * u) * cos(-720 * v + 20)", [true, true]),
            ("sin(100 * u)", [false, true]),
            ("sin(x * 360 / 8)", [true, true]),
            ("fract(4 * u + 1.5)", [true, true]),
            ("x % 8 < y % 16", [true, true]),
            ("x % 7", [false, true]),
            ("floor(u * 8) % 2", [true, true]),
            ("(floor(u * 8) + floor(v * 8)) % 2", [true, true]),
            ("random(floor(u * 8))", [false, true]),
            ("random(floor(u * 8) % 8)", [true, true]),
            ("noise(8 * u, 8 * v)", [true, true]),
            ("noise(x / 5, y / 4)", [false, true]),
            ("noise(x / 4, y / 4) + noise(4 * u + 4 * v, 4 * v - 4 * u)", [true, true]),
            ("if(u < 2, 1, 2)", [false, true]),
            ("abs(sin(180 * u))", [false, true]),
        ] {
            assert_eq!(tiling(formula), expected, "{formula}");
            // What is said to repeat does.
            result(formula, &[]);
        }
    }

    #[test]
    fn faults_lie_within_the_formula() {
        let told = |formula: &str, inputs: usize| {
            let problems = node(formula, inputs).check_on(&canvas());
            problems.into_iter().map(|p| (p.code, p.within.unwrap_or_default())).collect::<Vec<_>>()
        };
        assert_eq!(told("a * b + zz", 1), [(Code::MissingInput, 4..5), (Code::BadExpression, 8..10)]);
        assert_eq!(told("a *", 1), [(Code::BadExpression, 3..3)]);
        assert_eq!(told("= a + lenght(a)", 1), [(Code::BadExpression, 6..12)]);
        assert_eq!(told("  ", 0).len(), 1);
        let types = |formula: &str, inputs: &[(&str, Type)]| node(formula, 2).type_of_output(inputs);
        assert_eq!(types("a", &[("a", Type::Normal)]), Ok(Type::Rgb));
        assert_eq!(types("a * b", &[("a", Type::Gray), ("b", Type::Jacobian)]), Ok(Type::Jacobian));
        let wrong = types("2 * a.r", &[("a", Type::Gray)]).unwrap_err();
        assert_eq!((wrong[0].within.clone(), wrong[0].field.as_deref()), (Some(4..7), Some("formula")));
        let wrong = types("a + b", &[("a", Type::Rgb), ("b", Type::Vec2)]).unwrap_err();
        assert_eq!(wrong[0].within, Some(4..5));
    }

    #[test]
    fn what_is_not_finite_is_told_with_its_place() {
        let field = result("1 / (x - 0.75)", &[]);
        let canvas = canvas();
        let warnings = std::sync::Mutex::new(Vec::new());
        let warn = |problem: Problem| warnings.lock().unwrap().push(problem.message);
        let mut tile = Tile::new(canvas.grid(canvas.resolution), Window { x: 0, y: 2, width: 8, height: 2 }, 1);
        field.source().fill(&Given::new(&[], None, &|| false).warning(&warn), &mut tile).unwrap();
        assert_eq!((tile.row(0, 0)[0], tile.row(0, 0)[1], tile.row(0, 1)[2]), (-2.0, 0.0, 2.0));
        let said = warnings.into_inner().unwrap();
        assert!(said.len() == 1 && said[0].contains("x = 0.750, y = 1.250 mm"), "{said:?}");
    }

    #[test]
    fn random_numbers_depend_on_the_seeds() {
        let of = |seed: u64, canvas_seed: u64| {
            let canvas = shibo_value::Canvas { seed: canvas_seed, ..canvas() };
            let node = Expression { seed, ..node("random(floor(x)) + noise(x, y)", 0) };
            let outputs = crate::testing::outputs(&node, &[], &canvas).unwrap();
            let Some(Value::Field(field)) = outputs.take("", true).cloned() else { panic!("no field") };
            values(&field)
        };
        assert_eq!(of(0, 1), of(0, 1));
        assert_ne!(of(0, 1), of(0, 2));
        assert_ne!(of(0, 1), of(1, 1));
    }
}
