//! Lightmaps with fewer texels than they were baked with: each new texel is the mean of the former ones that it
//! replaces (a box filter). Nothing is baked here, so that what the coarser texels cannot show is lost; a bake
//! at a lower density gives the same texels but also saves its time.

use std::collections::HashMap;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec2, Vec3};
use lumbre_mesh::TriangleMesh;

use crate::{Lightmap, LightmapImage, Mesh};

/// Replaces every lightmap of a World by one with `reduction` times fewer texels along each side, rounded up.
/// Texture coordinates stay as they are. 0 and 1 change nothing.
///
/// Where a new texel replaces both texels that a surface shows and others, such as those between charts, only
/// the former count. Charts that are less than a new texel apart share texels, and mix at their borders.
pub fn reduce_lightmaps(world: &mut World, reduction: u32) {
    if reduction <= 1 {
        return;
    }
    let mut shown: HashMap<*const LightmapImage, ShownImage> = HashMap::new();
    let mut lit = world.query::<(&Mesh, &Lightmap)>();
    for (mesh, map) in lit.iter(world) {
        let of = shown
            .entry(Arc::as_ptr(&map.image))
            .or_insert_with(|| ShownImage { image: Arc::clone(&map.image), meshes: Vec::new() });
        of.meshes.push(Arc::clone(&mesh.0));
    }
    let reduced: HashMap<*const LightmapImage, Arc<LightmapImage>> =
        shown.iter().map(|(key, shown)| (*key, Arc::new(reduced(shown, reduction)))).collect();
    let mut maps = world.query::<&mut Lightmap>();
    for mut map in maps.iter_mut(world) {
        if let Some(image) = reduced.get(&Arc::as_ptr(&map.image)) {
            map.image = Arc::clone(image);
        }
    }
}

/// A lightmap and the meshes that show it.
struct ShownImage {
    image: Arc<LightmapImage>,
    meshes: Vec<Arc<TriangleMesh>>,
}

fn reduced(shown: &ShownImage, reduction: u32) -> LightmapImage {
    let image = &shown.image;
    let (width, height) = (image.width.div_ceil(reduction), image.height.div_ceil(reduction));
    let covered = covered_texels(shown);
    let [columns, rows] = [(image.width, width), (image.height, height)].map(|(from, to)| spans(from, to));
    let (mut texels, mut is_shown) = (Vec::new(), Vec::new());
    for row in &rows {
        for column in &columns {
            let of = || {
                row.iter().flat_map(|&(y, tall)| {
                    column.iter().map(move |&(x, wide)| (y * image.width as usize + x, wide * tall))
                })
            };
            let surface =
                mean(of().filter(|&(at, _)| covered[at]).map(|(at, part)| (image.texels[at], part)));
            is_shown.push(surface.is_some());
            let padding = || mean(of().map(|(at, part)| (image.texels[at], part)));
            texels.push(surface.or_else(padding).unwrap_or_default());
        }
    }
    let texels = with_borders(&texels, &is_shown, width as usize);
    LightmapImage { width, height, texels, ..(**image).clone() }
}

/// For each of `to` new texels along a side, the former texels of `from` that it replaces, with the parts of them
/// that it covers.
fn spans(from: u32, to: u32) -> Vec<Vec<(usize, f64)>> {
    let scale = f64::from(from) / f64::from(to);
    let span = |at: u32| {
        let (begin, end) = (scale * f64::from(at), scale * f64::from(at + 1));
        let former = (begin.floor() as u32)..(end.ceil() as u32).min(from);
        let part = |at: u32| end.min(f64::from(at + 1)) - begin.max(f64::from(at));
        former.map(|at| (at as usize, part(at))).filter(|(_, part)| *part > 1e-9).collect()
    };
    (0..to).map(span).collect()
}

fn mean(texels: impl Iterator<Item = (Vec3, f64)>) -> Option<Vec3> {
    let add = |(sum, total), (texel, part): (Vec3, f64)| (sum + texel.as_dvec3() * part, total + part);
    let (sum, total) = texels.fold((glam::DVec3::ZERO, 0.0), add);
    (total > 0.0).then(|| (sum / total).as_vec3())
}

/// Gives texels beside those of a surface the mean of their neighbours there, since filtering reads them.
fn with_borders(texels: &[Vec3], is_shown: &[bool], width: usize) -> Vec<Vec3> {
    let height = texels.len() / width.max(1);
    let around = |at: usize| at.saturating_sub(1)..=at + 1;
    let bordered = |(at, texel): (usize, &Vec3)| {
        let (x, y) = (at % width, at / width);
        let places = around(y).flat_map(|y| around(x).map(move |x| (x, y)));
        let inside = places.filter(|(x, y)| *x < width && *y < height).map(|(x, y)| y * width + x);
        let neighbours = inside.filter(|place| is_shown[*place]).map(|place| (texels[place], 1.0));
        if is_shown[at] { *texel } else { mean(neighbours).unwrap_or(*texel) }
    };
    texels.iter().enumerate().map(bordered).collect()
}

/// Returns for each texel whether one of the meshes' triangles touches its square.
fn covered_texels(shown: &ShownImage) -> Vec<bool> {
    let (width, height) = (shown.image.width as usize, shown.image.height as usize);
    let size = DVec2::new(width as f64, height as f64);
    let mut covered = vec![false; width * height];
    for mesh in &shown.meshes {
        for triangle in mesh.indices.as_chunks::<3>().0 {
            let corner = |index: u32| mesh.uv1.get(index as usize).map(|uv| uv.as_dvec2() * size);
            let [Some(a), Some(b), Some(c)] = triangle.map(corner) else { continue };
            let (least, most) = (a.min(b).min(c), a.max(b).max(c));
            if !(least.is_finite() && most.is_finite()) {
                continue;
            }
            let columns = (least.x.max(0.0) as usize)..(most.x.ceil().max(0.0) as usize).min(width);
            for y in (least.y.max(0.0) as usize)..(most.y.ceil().max(0.0) as usize).min(height) {
                for x in columns.clone() {
                    let centre = DVec2::new(x as f64, y as f64) + 0.5;
                    covered[y * width + x] |= touches(&[a, b, c], centre);
                }
            }
        }
    }
    covered
}

/// Returns true if no edge of a triangle separates it from the unit square around a point. The bounds of both
/// are known to overlap.
fn touches(triangle: &[DVec2; 3], centre: DVec2) -> bool {
    !(0..3).any(|edge| {
        let (start, end, opposite) = (triangle[edge], triangle[(edge + 1) % 3], triangle[(edge + 2) % 3]);
        let across = (end - start).perp();
        // Half the width of the square, seen along the edge.
        let half = 0.5 * (across.x.abs() + across.y.abs());
        let (inside, of_centre) = (across.dot(opposite - start), across.dot(centre - start));
        if inside >= 0.0 { of_centre < -half } else { of_centre > half }
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::LightmapEncoding;

    /// A square whose chart is this rectangle of its map, in parts of it.
    fn square(from: Vec2, to: Vec2) -> Mesh {
        let uv1 = vec![from, Vec2::new(to.x, from.y), to, Vec2::new(from.x, to.y)];
        let positions = uv1.iter().map(|uv| uv.extend(0.0)).collect();
        let indices = vec![0, 1, 2, 0, 2, 3];
        Mesh(Arc::new(TriangleMesh { positions, uv1, indices, ..TriangleMesh::default() }))
    }

    fn image(width: u32, height: u32, texel: impl Fn(u32, u32) -> f32) -> Arc<LightmapImage> {
        let texels = (0..width * height).map(|at| Vec3::splat(texel(at % width, at / width))).collect();
        let encoding = LightmapEncoding::Rgb32Float;
        Arc::new(LightmapImage { name: "map.exr".into(), width, height, texels, encoding })
    }

    fn halved(image: &Arc<LightmapImage>, charts: &[[Vec2; 2]], reduction: u32) -> Arc<LightmapImage> {
        let mut world = World::new();
        for [from, to] in charts {
            world.spawn((square(*from, *to), Lightmap { image: Arc::clone(image) }));
        }
        reduce_lightmaps(&mut world, reduction);
        let maps: Vec<Arc<LightmapImage>> =
            world.query::<&Lightmap>().iter(&world).map(|map| Arc::clone(&map.image)).collect();
        assert!(maps.iter().all(|map| Arc::ptr_eq(map, &maps[0])), "a shared map stays shared");
        Arc::clone(&maps[0])
    }

    const WHOLE: [Vec2; 2] = [Vec2::ZERO, Vec2::ONE];

    #[test]
    fn four_texels_become_their_mean() {
        let map = halved(&image(4, 2, |x, y| (x + 4 * y) as f32), &[WHOLE], 2);
        assert_eq!((map.width, map.height), (2, 1));
        // (0 + 1 + 4 + 5) / 4 and (2 + 3 + 6 + 7) / 4.
        assert_eq!(map.texels, [Vec3::splat(2.5), Vec3::splat(4.5)]);
        // Sides that are no multiple: of five texels the third belongs to both halves of the first two of three.
        let odd = halved(&image(5, 1, |x, _| x as f32), &[WHOLE], 2);
        let expected = [(0.0 + 1.0 * 2.0 / 3.0) / (5.0 / 3.0), 2.0, (4.0 + 3.0 * 2.0 / 3.0) / (5.0 / 3.0)];
        for (texel, expected) in odd.texels.iter().zip(expected) {
            assert!((texel.x - expected).abs() < 1e-6, "{:?}", odd.texels);
        }
        let same = image(3, 3, |x, _| x as f32);
        assert!(Arc::ptr_eq(&halved(&same, &[WHOLE], 1), &same));
    }

    #[test]
    fn what_no_surface_shows_does_not_darken_its_edge() {
        // A bright chart of five columns on a black map: the third new column replaces one of its texels.
        let charts = [[Vec2::ZERO, Vec2::new(0.5, 1.0)]];
        let map = halved(&image(10, 2, |x, _| if x < 5 { 7.0 } else { 0.0 }), &charts, 2);
        // The fourth lies beside the surface, and filtering reads it at the chart's edge.
        assert_eq!(map.texels.iter().map(|texel| texel.x).collect::<Vec<_>>(), [7.0, 7.0, 7.0, 7.0, 0.0]);
        // With the whole map in view, the black texels count.
        let whole = halved(&image(10, 2, |x, _| if x < 5 { 7.0 } else { 0.0 }), &[WHOLE], 2);
        assert_eq!(whole.texels.iter().map(|texel| texel.x).collect::<Vec<_>>(), [7.0, 7.0, 3.5, 0.0, 0.0]);
    }

    #[test]
    fn a_slanted_edge_covers_the_squares_that_it_crosses() {
        let triangle = [DVec2::ZERO, DVec2::new(4.0, 0.0), DVec2::new(0.0, 4.0)];
        let covered = |x: f64, y: f64| touches(&triangle, DVec2::new(x, y));
        assert!(covered(0.5, 0.5) && covered(3.5, 0.5) && covered(1.9, 2.9) && !covered(2.6, 2.6));
        let turned = [triangle[0], triangle[2], triangle[1]];
        assert!(touches(&turned, DVec2::new(1.9, 2.9)) && !touches(&turned, DVec2::new(2.6, 2.6)));
    }
}
