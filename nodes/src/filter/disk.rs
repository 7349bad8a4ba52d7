//! Filters whose footprint is a disk.
use shibo_kernel::filter::disk::Disk;
use shibo_kernel::ground::tile;
use shibo_kernel::ground::window::View;
use shibo_value::{Field, Halo, Tile, Window};

/// A field computed from the disk of `radius` mm around each place, channel by channel.
pub(super) fn of_disks(
    input: Field,
    radius: f64,
    filter: impl Fn(&View<'_>, Window, &Disk, &mut [f32]) + Send + Sync + 'static,
) -> Field {
    let halo = Halo::new(move |grid| Disk::new(radius, tile::step(grid)).halo()).from_parameter("radius");
    Field::map(input.ty(), [input], halo, move |out: &mut Tile, [input]: [&Tile; 1]| {
        let (disk, rect) = (Disk::new(radius, tile::step(&out.grid)), out.window);
        for (k, out) in out.planes_mut().into_iter().enumerate() {
            filter(&tile::view(input, k), rect, &disk, out);
        }
        Ok(())
    })
}
