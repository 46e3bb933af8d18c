//! Direct light of the patches by that of the texels that lie on them: those have it already, and more exactly than a few rays of the
//! patch's own would find it. Not of patches that too few texels tell of: those cast rays (`exchange`).

use glam::{DVec3, Vec2, Vec3};

use super::covered_texels::CoveredTexels;
use super::direct_light::DirectLight;
use super::footprint::{Footprint, Texel, barycentric};
use crate::scene::BakeScene;
use crate::scene::material::Side;
use crate::transport::patches::Patches;

/// Fewest texels that tell a patch's light, in each half of them: of fewer, too much lies across its border.
const FEWEST: f64 = 2.0;

/// Mean direct irradiance of each patch, mixed lights included, by either half of its texels: the fields of a chessboard. `None` where there
/// are too few of them. Texels that walls divide hold the light of both sides, and so tell of neither.
pub(crate) fn patch_light(
    scene: &BakeScene,
    texels: &CoveredTexels<'_>,
    direct: &DirectLight,
    patches: &Patches,
) -> Vec<Option<[Vec3; 2]>> {
    let mut divided = vec![false; texels.list.len()];
    texels.straddling.iter().for_each(|straddling| divided[straddling.texel.place()] = true);
    let mut sums = vec![[(DVec3::ZERO, 0.0f64); 2]; patches.list.len()];
    let told = texels.list.iter().zip(&direct.texels).zip(divided).filter(|(_, divided)| !divided);
    for ((texel, direct), _) in told {
        let (half, light) = (((texel.x + texel.y) & 1) as usize, direct.total().as_dvec3());
        for_each_point(scene, texel, |triangle, at, share| {
            if let Some(patch) = patches.at(triangle, Side::Front, at) {
                let (sum, weight) = &mut sums[patch as usize][half];
                *sum += light * share;
                *weight += share;
            }
        });
    }
    let mean = |halves: [(DVec3, f64); 2]| {
        let enough = halves.iter().all(|(_, weight)| *weight >= FEWEST);
        enough.then(|| halves.map(|(sum, weight)| (sum / weight).as_vec3()))
    };
    sums.into_iter().map(mean).collect()
}

/// Evenly spread points of what a texel shows: the triangle, barycentric weights, and the share of the texel that it stands for.
fn for_each_point(scene: &BakeScene, texel: &Texel, mut visit: impl FnMut(u32, (f32, f32), f64)) {
    match &texel.footprint {
        Footprint::Whole(triangle) => {
            let corner = Vec2::new(texel.x as f32, texel.y as f32);
            for offset in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
                if let Some(at) =
                    barycentric(&scene.triangles[*triangle as usize], corner + Vec2::from(offset))
                {
                    visit(*triangle, at, 0.25);
                }
            }
        }
        // At most a texel together: of few points each is less.
        Footprint::Points(points) => {
            let share = 1.0 / points.len().max(16) as f64;
            points.iter().for_each(|point| visit(point.triangle, point.at, share));
        }
        Footprint::Hidden => {}
    }
}
