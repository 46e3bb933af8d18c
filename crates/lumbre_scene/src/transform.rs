//! Where things are: local and global transforms, and their propagation down the hierarchy. Not the hierarchy itself:
//! that is bevy_ecs' `ChildOf` and `Children`.

use bevy_ecs::prelude::*;
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// Position, rotation and scale relative to the parent (`ChildOf`), or to the world without one.
///
/// f64, so that a level ten thousand kilometres from the origin still stands still: the renderer subtracts the camera before it
/// rounds to f32.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
#[require(GlobalTransform)]
pub struct Transform {
    /// Metres.
    pub translation: DVec3,
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Factor per axis; negative mirrors, zero flattens.
    pub scale: DVec3,
}

impl Transform {
    /// The transform that changes nothing.
    pub const IDENTITY: Self =
        Self { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE };

    /// A translation in metres.
    pub fn from_translation(translation: DVec3) -> Self {
        Self { translation, ..Self::IDENTITY }
    }

    /// A translation in metres, from components.
    pub fn from_xyz(x: f64, y: f64, z: f64) -> Self {
        Self::from_translation(DVec3::new(x, y, z))
    }

    /// A rotation.
    pub fn from_rotation(rotation: DQuat) -> Self {
        Self { rotation, ..Self::IDENTITY }
    }

    /// A scale, the same along all axes.
    pub fn from_scale(factor: f64) -> Self {
        Self { scale: DVec3::splat(factor), ..Self::IDENTITY }
    }

    /// The same with another rotation.
    pub fn with_rotation(self, rotation: DQuat) -> Self {
        Self { rotation, ..self }
    }

    /// The same with another scale.
    pub fn with_scale(self, scale: DVec3) -> Self {
        Self { scale, ..self }
    }

    /// The same place, with -Z pointing at `target` and +Y as near to `up` as possible. A target at the place itself, or in
    /// line with `up`, still gives a rotation: some perpendicular axis stands in.
    pub fn looking_at(self, target: DVec3, up: DVec3) -> Self {
        let back = (self.translation - target).try_normalize().unwrap_or(DVec3::Z);
        let right = up.cross(back).try_normalize().unwrap_or_else(|| back.any_orthonormal_vector());
        let rotation = DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back)).normalize();
        Self { rotation, ..self }
    }

    /// The matrix.
    pub fn affine(&self) -> DAffine3 {
        DAffine3::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }

    /// Decomposes an affine matrix. Zero columns (flattened axes) and mirrored bases are kept; the second value is false
    /// if the matrix holds a shear, which a translation, rotation and scale cannot express.
    pub fn from_affine(affine: DAffine3) -> (Self, bool) {
        let m = affine.matrix3;
        let mut scale = DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
        if m.determinant() < 0.0 {
            scale.x = -scale.x;
        }
        let axis = |column: DVec3, length: f64| (length != 0.0).then(|| column / length);
        let (x, y, z) = match (axis(m.x_axis, scale.x), axis(m.y_axis, scale.y), axis(m.z_axis, scale.z)) {
            (Some(x), Some(y), _) => (x, y, x.cross(y)),
            (Some(x), None, Some(z)) => (x, z.cross(x), z),
            (None, Some(y), Some(z)) => (y.cross(z), y, z),
            (Some(x), None, None) => (x, x.any_orthonormal_vector(), DVec3::ZERO),
            (None, Some(y), None) => (y.any_orthonormal_vector(), y, DVec3::ZERO),
            (None, None, Some(z)) => (z.any_orthonormal_vector(), DVec3::ZERO, z),
            (None, None, None) => (DVec3::X, DVec3::Y, DVec3::Z),
        };
        // Gram-Schmidt on whatever is left, so that the quaternion is always a rotation.
        let x = x.try_normalize().unwrap_or(DVec3::X);
        let y = if y == DVec3::ZERO { z.cross(x) } else { y };
        let y = (y - x * x.dot(y)).try_normalize().unwrap_or_else(|| x.any_orthonormal_vector());
        let rotation = DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y))).normalize();
        let result = Self { translation: affine.translation, rotation, scale };
        let size = m.x_axis.abs().max(m.y_axis.abs()).max(m.z_axis.abs()).max_element();
        // Files hold f32: a few of its roundings are no shear.
        let faithful = result.affine().matrix3.abs_diff_eq(m, 1e-5 * size.max(f64::MIN_POSITIVE));
        (result, faithful)
    }
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// The transform from an entity's space to the world, written by [`propagate_transforms`].
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct GlobalTransform(pub DAffine3);

impl GlobalTransform {
    /// World position in metres.
    pub fn translation(&self) -> DVec3 {
        self.0.translation
    }

    /// The unit vector of the entity's -Z axis in the world: where a light shines and a camera looks. A flattened axis
    /// gives -Z.
    pub fn forward(&self) -> DVec3 {
        (-self.0.matrix3.z_axis).try_normalize().unwrap_or(DVec3::NEG_Z)
    }

    /// Transforms normals under any scale, mirrored or singular too: the cofactor matrix of the linear part times the
    /// determinant's sign, which is |det| times the inverse transpose where there is one. Normalize the result.
    pub fn normal_matrix(&self) -> DMat3 {
        let m = self.0.matrix3;
        let side = if self.mirrors() { -1.0 } else { 1.0 };
        DMat3::from_cols(
            m.y_axis.cross(m.z_axis) * side,
            m.z_axis.cross(m.x_axis) * side,
            m.x_axis.cross(m.y_axis) * side,
        )
    }

    /// Whether counter-clockwise triangles become clockwise: the determinant is negative.
    pub fn mirrors(&self) -> bool {
        self.0.matrix3.determinant() < 0.0
    }
}

impl Default for GlobalTransform {
    fn default() -> Self {
        Self(DAffine3::IDENTITY)
    }
}

/// Runs [`propagate_transforms`] once, for code without a schedule.
pub fn update_transforms(world: &mut World) {
    let mut state = bevy_ecs::system::SystemState::<(
        Query<Root<'static>, RootFilter>,
        Query<Node<'static>, With<ChildOf>>,
        Query<&Children>,
    )>::new(world);
    // Queries are there in every World; only resources may be missing.
    if let Ok((roots, nodes, children)) = state.get_mut(world) {
        propagate_transforms(roots, nodes, children);
    }
}

/// A place in the world, and what it comes to.
type Node<'w> = (&'w Transform, &'w mut GlobalTransform);
/// An entity at the top of a hierarchy, with a place or without.
type Root<'w> = (Entity, Option<Node<'w>>);
type RootFilter = (Without<ChildOf>, Or<(With<Transform>, With<Children>)>);

/// Writes every [`GlobalTransform`] from the [`Transform`]s above it. An entity without a `Transform` stands where its parent does, and so its children are
/// placed as if they were its parent's. Entities whose value does not change are not marked as changed, so that only what moved is uploaded.
pub fn propagate_transforms(
    mut roots: Query<Root<'_>, RootFilter>,
    mut nodes: Query<Node<'_>, With<ChildOf>>,
    children: Query<&Children>,
) {
    // Below nothing that has a place, a place is one in the world.
    let place = |node: Option<(&Transform, Mut<GlobalTransform>)>, parent: Option<DAffine3>| {
        let Some((transform, mut global)) = node else { return parent };
        let affine = transform.affine();
        let affine = parent.map_or(affine, |parent| parent * affine);
        global.set_if_neq(GlobalTransform(affine));
        Some(affine)
    };
    let mut stack = Vec::new();
    for (entity, node) in &mut roots {
        stack.push((entity, place(node, None)));
        while let Some((parent, affine)) = stack.pop() {
            let Ok(list) = children.get(parent) else { continue };
            for &child in list {
                stack.push((child, place(nodes.get_mut(child).ok(), affine)));
            }
        }
    }
}
