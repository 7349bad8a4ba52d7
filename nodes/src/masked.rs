//! A mix of two fields by a weight. Where the weight hides one of them in a whole window, that field is not computed
//! there.
use crate::anywhere::constant;
use shibo_kernel::ground::tile::channel;
use shibo_kernel::surface::layers::bounds;
use shibo_kernel::wood::solids::Code;
use shibo_value::{Cost, Field, FieldSource, Given, Grid, Planes, Read, Solid, Stop, Tile, Tiling, Type, Window};

/// The values of one side of a blend: those of a channel, and of the channels beside it.
pub(crate) type Side<'a> = &'a [Planes<'a>];

/// Fills the planes from the weights, the base and the top. Where the weight is 0 or 1, the result must have exactly the
/// bits of the side that shows, as if the other side did not exist.
pub(crate) type Mix = Box<dyn Fn(&mut [&mut [f32]], &[f32], Side<'_>, Side<'_>) + Send + Sync>;

/// Two sides, mixed by a weight from 0 (the base) to 1 (the top).
pub(crate) struct Masked {
    pub(crate) weight: Field,
    /// The fields below; the first one shows where the weight is 0.
    pub(crate) base: Vec<Field>,
    /// The fields above.
    pub(crate) top: Vec<Field>,
    /// If given, the first field of the top plus this number shows where the weight is 1; with `None` the base shows
    /// through even there.
    pub(crate) covering: Option<f32>,
    pub(crate) mix: Mix,
}

impl Masked {
    /// The field.
    pub(crate) fn field(self, ty: Type) -> Field {
        if let Some(constant) = self.constant(ty) {
            return constant;
        }
        let inputs = self.base.iter().chain(&self.top).chain([&self.weight]);
        let tiling = inputs.fold(Tiling::BOTH, |tiling, input| tiling.and(input.tiling()));
        Field::new(ty, tiling, self)
    }

    /// The field as a constant, if all fields are constant.
    fn constant(&self, ty: Type) -> Option<Field> {
        let side = |fields: &[Field]| {
            fields.iter().map(|field| field.as_constant().map(<[f32]>::to_vec)).collect::<Option<Vec<_>>>()
        };
        let (weight, base, top) = (self.weight.as_constant()?, side(&self.base)?, side(&self.top)?);
        let [base, top] = [&base, &top].map(|side| side.iter().map(|v| Planes::new(v, 1)).collect::<Vec<_>>());
        let shown = |side: Side<'_>, shift: f32, out: &mut [&mut [f32]]| {
            out.iter_mut().enumerate().for_each(|(k, out)| out[0] = plane(&side[0], k)[0] + shift);
        };
        Some(constant(ty, |out| match (bounds(weight), self.covering) {
            ((_, high), _) if high <= 0.0 => shown(&base, 0.0, out),
            ((low, _), Some(shift)) if low >= 1.0 => shown(&top, shift, out),
            _ => (self.mix)(out, weight, &base, &top),
        }))
    }

    /// Tells for the base and for the top if they show anywhere.
    fn shown(&self, weight: &Tile) -> (bool, bool) {
        let (low, high) = bounds(weight.data());
        (self.covering.is_none() || low < 1.0, high > 0.0)
    }
}

impl FieldSource for Masked {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.weight, grid, window)]
    }

    fn later(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.base.iter().chain(&self.top).map(|field| Read::new(field, grid, window)).collect()
    }

    fn narrow(&self, given: &Given<'_>, _grid: &Grid, window: Window) -> Vec<Window> {
        let (base, top) = self.shown(given.tile(0));
        let part = |shown: bool| if shown { window } else { Window { width: 0, height: 0, ..window } };
        let of = |fields: &[Field], shown| vec![part(shown); fields.len()];
        [of(&self.base, base), of(&self.top, top)].concat()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let tiles: Vec<&Tile> = given.tiles().collect();
        let (weight, sides) = (tiles[0], &tiles[1..]);
        let (base, top) = sides.split_at(self.base.len());
        match (self.shown(weight), self.covering) {
            ((_, false), _) => copy(out, base[0], |value| value),
            ((false, _), Some(shift)) => copy(out, top[0], |value| value + shift),
            _ => {
                let [base, top] = [base, top].map(|side| side.iter().map(|tile| planes(tile)).collect::<Vec<_>>());
                (self.mix)(&mut out.planes_mut(), weight.plane(0), &base, &top);
            }
        }
        Ok(())
    }

    fn cost(&self) -> Cost {
        Cost::Pointwise
    }
}

fn planes(tile: &Tile) -> Planes<'_> {
    Planes::new(tile.data(), tile.window.len())
}

/// A channel of one side; the only channel if there is just one.
pub(crate) fn plane<'a>(side: &Planes<'a>, channel: usize) -> &'a [f32] {
    side.plane(channel.min(side.channels() - 1))
}

/// The mix of solids by a solid weight.
pub(crate) fn mixed_solids(ty: Type, weight: &Solid, base: Vec<Solid>, top: Vec<Solid>, mix: Mix) -> Solid {
    let below = base.len();
    let code = Code::of_inputs(move |_, inputs, out| {
        if let Some((weight, sides)) = inputs.split_first() {
            let (base, top) = sides.split_at(below);
            mix(out, weight.plane(0), base, top);
        }
    });
    code.solid(ty, [vec![weight.clone()], base, top].concat())
}

fn copy(out: &mut Tile, from: &Tile, change: impl Fn(f32) -> f32) {
    for (k, plane) in out.planes_mut().into_iter().enumerate() {
        plane.iter_mut().zip(channel(from, k)).for_each(|(out, value)| *out = change(*value));
    }
}
