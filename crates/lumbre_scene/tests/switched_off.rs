//! Builds without optional decoders: a file that requires one is refused with the name of the extension, the
//! cargo feature that enables it, and a command for conversion. Run by `cargo test -p lumbre_scene
//! --no-default-features --test switched_off`; empty if a decoder is compiled in.

#![cfg(not(any(feature = "basisu", feature = "draco", feature = "webp")))]
#![allow(clippy::unwrap_used, reason = "a test stops where something is not as it has to be")]

#[path = "support/encoded.rs"]
mod encoded;
mod support;

use encoded::{MESHES, PICTURES, compressed_mesh, encoded_picture};
use lumbre_scene::LoadProblem;
use serde_json::json;

#[test]
fn files_are_refused_with_the_feature_and_the_remedy() {
    let mesh = compressed_mesh(MESHES[0].1, &serde_json::from_slice(MESHES[0].2).unwrap());
    let (uastc, webp) =
        (encoded_picture(PICTURES[0].0, PICTURES[0].1), encoded_picture(PICTURES[4].0, PICTURES[4].1));
    for (file, extension, feature, remedy) in [
        (mesh, "KHR_draco_mesh_compression", "`draco`", "gltf-transform/cli copy"),
        (uastc, "KHR_texture_basisu", "`basisu`", "ktxdecompress"),
        (webp, "EXT_texture_webp", "`webp`", "png --formats"),
    ] {
        let problem = file.problem();
        let text = problem.to_string();
        assert!(matches!(problem, LoadProblem::SwitchedOff { .. }), "{text}");
        assert!([extension, feature, remedy].iter().all(|said| text.contains(said)), "{text}");
    }
}

#[test]
fn what_does_not_require_a_decoder_is_shown_without() {
    for (name, bytes, _) in [PICTURES[0], PICTURES[4]] {
        let mut file = encoded_picture(name, bytes);
        file.root["extensionsRequired"] = json!([]);
        let (_, report) = file.load().unwrap();
        assert!(report.notes.iter().any(|note| note.text.contains("left out")), "{:?}", report.notes);
    }
}
