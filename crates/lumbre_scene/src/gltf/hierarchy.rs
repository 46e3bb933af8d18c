//! The node trees of a file, validated: no cycles, and at most one parent per node.

use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::document::{Document, Node, element};
use super::error::{LoadProblem, Notes};
use crate::Transform;

/// The nodes of the default scene.
pub(crate) struct Hierarchy {
    /// Node indices, with every parent before its children.
    pub order: Vec<usize>,
    /// The parent of each node of the file, or `None` for roots.
    pub parents: Vec<Option<usize>>,
    /// Index of the scene; `None` if the file has no scenes.
    pub scene: Option<usize>,
}

/// Checks all nodes of a file and lists those of its default scene, or all nodes if it has no scenes.
pub(crate) fn hierarchy(document: &Document, notes: &mut Notes) -> Result<Hierarchy, LoadProblem> {
    let count = document.nodes.len();
    let name = |node: usize| document.nodes[node].name.clone().unwrap_or_default();
    let twice = |node: usize, first: String, second: String| LoadProblem::TwoParents {
        node,
        name: name(node),
        first,
        second,
    };
    let mut parents: Vec<Option<usize>> = vec![None; count];
    for (index, node) in document.nodes.iter().enumerate() {
        for &child in &node.children {
            element(&document.nodes, "nodes", child, || format!("nodes[{index}].children"))?;
            if child == index {
                return Err(LoadProblem::Cycle { node: child, name: name(child) });
            }
            if let Some(first) = parents[child] {
                let problem =
                    twice(child, format!("nodes[{first}].children"), format!("nodes[{index}].children"));
                notes.repair(&document.node_place(child), problem, "it stays where it was listed first")?;
                continue;
            }
            parents[child] = Some(index);
        }
    }
    let below = |roots: &[usize], reached: &mut Vec<bool>| {
        let mut order = Vec::new();
        let mut stack: Vec<usize> = roots.iter().rev().copied().collect();
        while let Some(node) = stack.pop() {
            if !std::mem::replace(&mut reached[node], true) {
                order.push(node);
                let children = document.nodes[node].children.iter().rev();
                stack.extend(children.filter(|&&child| parents[child] == Some(node)));
            }
        }
        order
    };
    let roots: Vec<usize> = (0..count).filter(|&node| parents[node].is_none()).collect();
    let mut reached = vec![false; count];
    let everything = below(&roots, &mut reached);
    // Every node has at most one parent here, so a node that no root reaches is on or below a cycle.
    if let Some(node) = reached.iter().position(|&reached| !reached) {
        return Err(LoadProblem::Cycle { node, name: name(node) });
    }
    let scene = match document.scene {
        Some(scene) => match element(&document.scenes, "scenes", scene, || "scene".to_owned()) {
            Ok(_) => Some(scene),
            Err(problem) => {
                notes.repair("scene", problem, "the first is shown")?;
                (!document.scenes.is_empty()).then_some(0)
            }
        },
        None => (!document.scenes.is_empty()).then_some(0),
    };
    let order = match scene {
        None => everything,
        Some(scene) => {
            let place = format!("scenes[{scene}].nodes");
            let listed = &document.scenes[scene].nodes;
            let mut roots = Vec::new();
            let mut seen = vec![false; count];
            for &node in listed {
                element(&document.nodes, "nodes", node, || place.clone())?;
                if std::mem::replace(&mut seen[node], true) {
                    let problem = twice(node, place.clone(), place.clone());
                    notes.repair(&document.node_place(node), problem, "it is shown once")?;
                } else if let Some(parent) = parents[node] {
                    let problem = twice(node, format!("nodes[{parent}].children"), place.clone());
                    notes.repair(&document.node_place(node), problem, "it stays below its parent")?;
                    // If none of its ancestors is listed in the scene, the node becomes a root.
                    let mut above = std::iter::successors(Some(node), |&node| parents[node]).skip(1);
                    let is_listed = |above: usize| listed.contains(&above);
                    if !above.any(is_listed) {
                        roots.push(node);
                    }
                } else {
                    roots.push(node);
                }
            }
            below(&roots, &mut vec![false; count])
        }
    };
    if order.len() < count {
        notes.add(
            "nodes",
            format!("{} of {count} are not in the scene that is shown; left out", count - order.len()),
        );
    }
    Ok(Hierarchy { order, parents, scene })
}

/// The local transform of a node.
pub(crate) fn transform(node: &Node, place: &str, notes: &mut Notes) -> Result<Transform, LoadProblem> {
    let refused = |field: &str, value: String, expected: &str| LoadProblem::Value {
        place: place.to_owned(),
        field: field.to_owned(),
        value,
        expected: expected.to_owned(),
    };
    if let Some(matrix) = node.matrix {
        let matrix = DMat4::from_cols_array(&matrix);
        let rounding = 1e-6;
        let last_row = matrix.row(3);
        if !matrix.is_finite() || !last_row.abs_diff_eq(glam::DVec4::W, rounding) {
            return Err(refused(
                "matrix",
                matrix.to_string(),
                "use finite numbers with 0, 0, 0, 1 in the last row",
            ));
        }
        let (transform, faithful) = Transform::from_affine(DAffine3::from_mat4(matrix));
        if !faithful {
            notes.add(place, "its matrix shears, which a translation, rotation and scale cannot express; the shear is dropped");
        }
        return Ok(transform);
    }
    let vector = |field: &str, value: Option<[f64; 3]>, default: DVec3| {
        let value = value.map_or(default, DVec3::from_array);
        if representable(value) {
            Ok(value)
        } else {
            Err(refused(field, value.to_string(), "use numbers below 1e30"))
        }
    };
    let translation = vector("translation", node.translation, DVec3::ZERO)?;
    let scale = vector("scale", node.scale, DVec3::ONE)?;
    let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    let length = rotation.length();
    if !(length.is_finite() && length > 1e-6) {
        return Err(refused("rotation", rotation.to_string(), "use a unit quaternion [x, y, z, w]"));
    }
    // Already a unit quaternion up to rounding: keep its exact components.
    let rotation = if (length - 1.0).abs() < 1e-12 { rotation } else { rotation / length };
    Ok(Transform { translation, rotation, scale })
}

/// Bounds components so that chains of transforms stay finite in f64.
fn representable(value: DVec3) -> bool {
    value.is_finite() && value.abs().max_element() < 1e30
}
