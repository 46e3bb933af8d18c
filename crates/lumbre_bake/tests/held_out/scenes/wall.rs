//! Walls with a thickness and windows, built of slabs, and the ground outside.

use super::builder::{Builder, NONE, WHITE, matt};

/// A window: where it begins and ends along the wall, the height of its sill and of its lintel.
pub type Opening = [f64; 4];

pub struct Wall {
    /// Whether the wall runs along x; otherwise it runs along z.
    pub along_x: bool,
    /// The coordinates along the wall at which it begins and ends.
    pub ends: [f64; 2],
    /// The coordinates of its two faces across the wall.
    pub across: [f64; 2],
    pub height: f64,
    pub color: [f32; 3],
}

impl Wall {
    fn corner(&self, along: f64, y: f64, across: f64) -> [f64; 3] {
        if self.along_x { [along, y, across] } else { [across, y, along] }
    }

    fn slab(
        &self,
        b: &mut Builder,
        name: &str,
        from: [f64; 2],
        to: [f64; 2],
        across: [f64; 2],
        color: [f32; 3],
    ) {
        let low = self.corner(from[0], from[1], across[0]);
        b.block(name, low, self.corner(to[0], to[1], across[1]), color, 0.0);
    }

    /// Adds the wall with its openings, and a window frame with a bar in each opening.
    pub fn build(&self, b: &mut Builder, openings: &[Opening]) {
        let mut from = self.ends[0];
        for &[begin, end, sill, lintel] in openings {
            self.slab(b, "wall", [from, 0.0], [begin, self.height], self.across, self.color);
            self.slab(b, "wall below a window", [begin, 0.0], [end, sill], self.across, self.color);
            self.slab(b, "wall above a window", [begin, lintel], [end, self.height], self.across, self.color);
            let middle = (self.across[0] + self.across[1]) / 2.0;
            let frame = [middle - 0.025, middle + 0.025];
            self.slab(b, "window frame", [begin, sill], [begin + 0.05, lintel], frame, WHITE);
            self.slab(b, "window frame", [end - 0.05, sill], [end, lintel], frame, WHITE);
            let (begin, end) = (begin + 0.05, end - 0.05);
            self.slab(b, "window frame", [begin, sill], [end, sill + 0.05], frame, WHITE);
            self.slab(b, "window frame", [begin, lintel - 0.05], [end, lintel], frame, WHITE);
            let bar = (begin + end) / 2.0;
            self.slab(
                b,
                "window bar",
                [bar - 0.025, sill + 0.05],
                [bar + 0.025, lintel - 0.05],
                frame,
                WHITE,
            );
            from = end + 0.05;
        }
        self.slab(b, "wall", [from, 0.0], [self.ends[1], self.height], self.across, self.color);
    }

    /// The rectangle of an opening in the middle of the wall, as a corner and two edges.
    pub fn rectangle(&self, [begin, end, sill, lintel]: Opening) -> [[f64; 3]; 3] {
        let middle = (self.across[0] + self.across[1]) / 2.0;
        [self.corner(begin, sill, middle), self.corner(end - begin, 0.0, 0.0), [0.0, lintel - sill, 0.0]]
    }
}

/// Adds a horizontal plane that faces up.
pub fn ground(b: &mut Builder, middle: [f64; 3], size: [f64; 2], color: [f32; 3]) {
    let [width, depth] = size.map(|side| (side * b.scale) as f32);
    let plane = lumbre_mesh::shapes::plane(width, depth, 1, 1);
    b.mesh("ground", plane, matt(color, NONE), middle.into(), 0.0);
}
