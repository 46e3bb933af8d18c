//! Local and global transforms, and their propagation down the hierarchy. The hierarchy itself is bevy_ecs'
//! `ChildOf` and `Children`.

use bevy_ecs::prelude::*;
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// Translation, rotation and scale relative to the parent (`ChildOf`), or to the world if there is no parent.
///
/// Stored in f64 so that a level ten thousand kilometres from the origin does not jitter: the renderer
/// subtracts the camera position before it rounds to f32.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
#[require(GlobalTransform)]
pub struct Transform {
    /// In metres.
    pub translation: DVec3,
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Factor per axis. A negative factor mirrors, zero flattens.
    pub scale: DVec3,
}

impl Transform {
    /// The identity transform.
    pub const IDENTITY: Self =
        Self { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE };

    /// A translation by a vector in metres.
    pub fn from_translation(translation: DVec3) -> Self {
        Self { translation, ..Self::IDENTITY }
    }

    /// A translation by x, y and z in metres.
    pub fn from_xyz(x: f64, y: f64, z: f64) -> Self {
        Self::from_translation(DVec3::new(x, y, z))
    }

    /// A rotation.
    pub fn from_rotation(rotation: DQuat) -> Self {
        Self { rotation, ..Self::IDENTITY }
    }

    /// A uniform scale.
    pub fn from_scale(factor: f64) -> Self {
        Self { scale: DVec3::splat(factor), ..Self::IDENTITY }
    }

    /// Returns this transform with its rotation replaced.
    pub fn with_rotation(self, rotation: DQuat) -> Self {
        Self { rotation, ..self }
    }

    /// Returns this transform with its scale replaced.
    pub fn with_scale(self, scale: DVec3) -> Self {
        Self { scale, ..self }
    }

    /// Returns this transform rotated so that -Z points at `target` and +Y is as close to `up` as possible.
    /// If the target coincides with the translation, -Z stays; if it is in line with `up`, an arbitrary
    /// perpendicular axis becomes +X.
    pub fn looking_at(self, target: DVec3, up: DVec3) -> Self {
        let back = (self.translation - target).try_normalize().unwrap_or(DVec3::Z);
        let right = up.cross(back).try_normalize().unwrap_or_else(|| back.any_orthonormal_vector());
        let rotation = DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back)).normalize();
        Self { rotation, ..self }
    }

    /// The transform as an affine matrix.
    pub fn affine(&self) -> DAffine3 {
        DAffine3::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }

    /// Decomposes an affine matrix. Zero columns (flattened axes) and mirrored bases are preserved. The
    /// second value is false if the matrix has a shear, which translation, rotation and scale cannot express.
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
        // Gram-Schmidt on the remaining axes, so that the quaternion is always a rotation.
        let x = x.try_normalize().unwrap_or(DVec3::X);
        let y = if y == DVec3::ZERO { z.cross(x) } else { y };
        let y = (y - x * x.dot(y)).try_normalize().unwrap_or_else(|| x.any_orthonormal_vector());
        let rotation = DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y))).normalize();
        let result = Self { translation: affine.translation, rotation, scale };
        let size = m.x_axis.abs().max(m.y_axis.abs()).max(m.z_axis.abs()).max_element();
        // Files store f32, so a deviation of a few f32 roundings is not a shear.
        let faithful = result.affine().matrix3.abs_diff_eq(m, 1e-5 * size.max(f64::MIN_POSITIVE));
        (result, faithful)
    }
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// The transform from an entity's local space to world space, written by [`propagate_transforms`].
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct GlobalTransform(pub DAffine3);

impl GlobalTransform {
    /// World position in metres.
    pub fn translation(&self) -> DVec3 {
        self.0.translation
    }

    /// The unit vector of the entity's -Z axis in world space: the direction in which a light shines or a
    /// camera looks. Returns world -Z if that axis is flattened.
    pub fn forward(&self) -> DVec3 {
        (-self.0.matrix3.z_axis).try_normalize().unwrap_or(DVec3::NEG_Z)
    }

    /// The matrix that transforms normals, valid for mirrored and singular transforms too: the cofactor
    /// matrix of the linear part times the sign of the determinant, which equals |det| times the inverse
    /// transpose where that exists. The transformed normals need normalization.
    pub fn normal_matrix(&self) -> DMat3 {
        let m = self.0.matrix3;
        let side = if self.mirrors() { -1.0 } else { 1.0 };
        DMat3::from_cols(
            m.y_axis.cross(m.z_axis) * side,
            m.z_axis.cross(m.x_axis) * side,
            m.x_axis.cross(m.y_axis) * side,
        )
    }

    /// Returns true if the transform reverses the winding of triangles, i.e. its determinant is negative.
    pub fn mirrors(&self) -> bool {
        self.0.matrix3.determinant() < 0.0
    }
}

impl Default for GlobalTransform {
    fn default() -> Self {
        Self(DAffine3::IDENTITY)
    }
}

/// Runs [`propagate_transforms`] once, for code that has no schedule.
pub fn update_transforms(world: &mut World) {
    let mut state = bevy_ecs::system::SystemState::<(
        Query<Root<'static>, RootFilter>,
        Query<Node<'static>, With<ChildOf>>,
        Query<&Children>,
    )>::new(world);
    // Fetching queries cannot fail; only a missing resource would be an error.
    if let Ok((roots, nodes, children)) = state.get_mut(world) {
        propagate_transforms(roots, nodes, children);
    }
}

/// The local transform of an entity and its global transform to be written.
type Node<'w> = (&'w Transform, &'w mut GlobalTransform);
/// The root entity of a hierarchy, which may lack a transform.
type Root<'w> = (Entity, Option<Node<'w>>);
type RootFilter = (Without<ChildOf>, Or<(With<Transform>, With<Children>)>);

/// Computes every [`GlobalTransform`] from the [`Transform`]s on the path to its root. An entity without a
/// `Transform` counts as the identity: its children are placed relative to its parent. Values that do not
/// change are not marked as changed, so that only moved objects are uploaded again.
pub fn propagate_transforms(
    mut roots: Query<Root<'_>, RootFilter>,
    mut nodes: Query<Node<'_>, With<ChildOf>>,
    children: Query<&Children>,
) {
    // `None` while no ancestor has a transform: the local transform is then the global one.
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
