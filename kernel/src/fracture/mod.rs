//! Fracture: a layer that shrinks on a substrate and cracks, as drying mud, glaze and paint do.
//!
//! Points are tied to their places by the substrate and to each other by springs ([`net`]). The springs' rest lengths
//! shrink, the most strained spring breaks, and the net relaxes ([`springs`]). The square root of E / k, the stiffness
//! of the layer over that of the substrate, is the length that sets the spacing of cracks. Broken springs are drawn as
//! the borders between the cells of their points ([`cracks`]), and plates curl up at their edges ([`curl`]). All of
//! this is computed once, in mm; [`draw`] answers for any point.
//!
//! Sources: the springs on a substrate after P. Meakin, "A simple model for elastic fracture in thin films" (1987); the
//! weights of Voronoi cells after J. Bolander, S. Saito, "Fracture analyses using spring networks with random geometry"
//! (1998); peeling after E. Paquette, P. Poulin, G. Drettakis, "The simulation of paint cracking and peeling" (2002).
//! Unlike there, time has no steps: the net is linear, and a heap holds the shrinkage at which each spring breaks.
pub mod cracks;
pub mod curl;
pub mod draw;
#[cfg(test)]
mod laws;
pub mod net;
pub mod springs;

use crate::ground::hash::Hash;
use crate::ground::stop::Until;
use cracks::Cracks;
use draw::Drawing;
use glam::DVec2;
use net::Net;
use springs::{Break, Law, Local};

/// Maximum number of points of a net.
pub const MOST: usize = 200_000;

/// A layer that cracks.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    /// The area that repeats, mm.
    pub size: DVec2,
    /// Distance of points, mm.
    pub pitch: f64,
    /// How the layer breaks.
    pub law: Law,
    /// Strain at which the layer breaks; widths of cracks are proportional to it.
    pub strain: f64,
}

impl Layer {
    /// Breaks the layer. `local` gives the properties at a place; `None` if stopped.
    pub fn crack(&self, local: impl Fn(DVec2) -> Local, hash: Hash, until: Until<'_>) -> Option<Drawing> {
        let net = Net::hexagons(self.size, self.pitch, hash, until)?;
        let local: Vec<Local> = net.sites.iter().map(|at| local(*at)).collect();
        let broken = Break::new(&net, &local, &self.law, hash, until)?;
        let cracks = Cracks::new(&net, &broken, self.strain);
        let curl = curl::curl(&net, &broken, &cracks, self.law.scale);
        Some(Drawing::new(&net, &broken, cracks, &curl))
    }
}
