//! The lit picture under a lamp: a key light with a wide highlight beside it, a weak fill light and a sky.
use super::COAT;
use super::block::{BLOCK, Block};
use super::light::{Along, Light};
use crate::ground::math::{max, min};

impl Block {
    #[inline(always)]
    pub(in crate::surface) fn shade_with<const FINISH: u8>(&mut self, lights: &[Light; 2]) {
        if self.anisotropy > 0.0 {
            self.shade::<FINISH, true>(lights);
        } else {
            self.shade::<FINISH, false>(lights);
        }
    }

    #[inline(always)]
    fn shade<const FINISH: u8, const ALONG: bool>(&mut self, lights: &[Light; 2]) {
        let [share, cosine, sine] = &self.fiber;
        let [nx, ny, nz] = &self.normal;
        let [red, green, blue] = &mut self.out;
        for i in 0..BLOCK {
            let n = [nx[i], ny[i], nz[i]];
            let along =
                if ALONG { Some(Along::new(n, [cosine[i], sine[i]], self.anisotropy * share[i])) } else { None };
            let pixel = Pixel { n, along, rough: self.rough[i], open: self.open[i] };
            let base = [self.color[0][i], self.color[1][i], self.color[2][i]];
            let finish = [self.finish[0][i], self.finish[1][i], self.finish[2][i]];
            let color = match FINISH {
                0 => pixel.color(base, lights),
                1 => pixel.finished(base, finish, (pixel.n, COAT), lights),
                _ => {
                    let own = [self.coat_normal[0][i], self.coat_normal[1][i], self.coat_normal[2][i]];
                    let normal = if own[2] > 0.0 { own } else { pixel.n };
                    let lit = pixel.finished(base, finish, (normal, self.coat_rough[i]), lights);
                    [lit[0] + self.emission[0][i], lit[1] + self.emission[1][i], lit[2] + self.emission[2][i]]
                }
            };
            [red[i], green[i], blue[i]] = color;
        }
    }
}

struct Pixel {
    n: [f32; 3],
    /// Fibres in the surface, if gloss is anisotropic; set for all pixels or for none.
    along: Option<Along>,
    rough: f32,
    open: f32,
}

/// A pixel under the lights, without its colour.
struct Lit {
    /// Light from all sides, by channel.
    diffuse: [f32; 3],
    /// Specular factors: of the key light with the area light beside it, and of the fill light.
    gloss: [f32; 2],
    /// The reflected sky at a reflectance of 1.
    mirror: f32,
}

impl Pixel {
    #[inline(always)]
    fn lit(&self, rough: f32, [key, fill]: &[Light; 2]) -> Lit {
        let rough = min(max(rough, 0.06), 1.0);
        let a2 = rough * rough * rough * rough;
        let shade = |light: &Light, a2: f32| match &self.along {
            Some(along) => light.shade_along(self.n, along, a2),
            None => light.shade(self.n, a2),
        };
        let (key_diffuse, key_gloss) = shade(key, a2);
        // An area light beside the key light: a second, wider highlight gives a gloss rather than points.
        let (_, wide) = shade(key, min(a2 * 4.0 + 0.1, 1.0));
        let (fill_diffuse, fill_gloss) = shade(fill, a2);
        let shadow = 0.5 + 0.5 * self.open;
        let toward = self.n[0] * key.l[0] + self.n[1] * key.l[1];
        let sky = self.open * (0.16 + 0.10 * self.n[2] + 0.10 * toward);
        let diffuse = |k: usize| key.color[k] * key_diffuse * shadow + fill.color[k] * fill_diffuse * self.open + sky;
        Lit {
            diffuse: [diffuse(0), diffuse(1), diffuse(2)],
            gloss: [(0.75 * key_gloss + 0.5 * wide) * shadow, fill_gloss * self.open * self.open],
            mirror: self.open * max(0.25 + 1.2 * toward, 0.0) * (1.0 - 0.6 * rough),
        }
    }

    #[inline(always)]
    fn color(&self, base: [f32; 3], lights: &[Light; 2]) -> [f32; 3] {
        let lit = self.lit(self.rough, lights);
        let [key, fill] = lights;
        let channel = |k: usize| {
            let gloss = key.color[k] * key.fresnel * lit.gloss[0] + fill.color[k] * fill.fresnel * lit.gloss[1];
            base[k] * lit.diffuse[k] * 0.96 + gloss + 0.04 * lit.mirror
        };
        [channel(0), channel(1), channel(2)]
    }

    /// Adds metal, sheen and a coat of that normal and roughness.
    #[inline(always)]
    fn finished(
        &self,
        base: [f32; 3],
        [metal, sheen, coat]: [f32; 3],
        (normal, rough): ([f32; 3], f32),
        lights: &[Light; 2],
    ) -> [f32; 3] {
        let (lit, [key, fill]) = (self.lit(self.rough, lights), lights);
        // The coat is smooth: it mirrors the lights themselves, without the wide highlight.
        let rough = min(max(rough, 0.06), 1.0);
        let smooth = rough * rough * rough * rough;
        let shadow = 0.5 + 0.5 * self.open;
        let side = self.open * self.open;
        let (over_key, over_fill) = (key.shade(normal, smooth).1 * shadow, fill.shade(normal, smooth).1 * side);
        let away = 1.0 - min(max(self.n[2], 0.0), 1.0);
        let nap = sheen * away * away;
        let channel = |k: usize| {
            let f0 = 0.04 + (base[k] - 0.04) * metal;
            let fresnel = |light: &Light, f0: f32| light.color[k] * (f0 + (1.0 - f0) * light.grazing);
            let gloss = fresnel(key, f0) * lit.gloss[0] + fresnel(fill, f0) * lit.gloss[1];
            let under = base[k] * (1.0 - metal) * lit.diffuse[k] * 0.96 + gloss + f0 * lit.mirror;
            let fuzz = nap * (0.5 + 0.5 * base[k]) * lit.diffuse[k];
            let clear = fresnel(key, 0.04) * over_key + fresnel(fill, 0.04) * over_fill;
            under * (1.0 - 0.06 * coat) + fuzz + coat * clear
        };
        [channel(0), channel(1), channel(2)]
    }
}
