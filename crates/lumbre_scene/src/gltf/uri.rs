//! Resolves the URIs of buffers and images: data URIs, and files in or below the folder of the glTF file. No
//! other URI is followed.

use std::path::{Path, PathBuf};

use super::document::shortened;
use super::error::LoadProblem;

/// The folders to which relative URIs may refer.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Base<'a> {
    /// The folder of the glTF file.
    pub folder: Option<&'a Path>,
    /// A folder above it; URIs that leave `folder` may refer to files below this one.
    pub root: Option<&'a Path>,
}

impl Base<'_> {
    /// The path of the file that a URI refers to.
    pub(crate) fn file(self, uri: &str, place: &str) -> Result<PathBuf, LoadProblem> {
        let refused = |problem: &str| LoadProblem::Uri {
            place: place.to_owned(),
            uri: shortened(uri).to_owned(),
            problem: problem.to_owned(),
        };
        match (relative(uri), self.folder, self.root) {
            (Ok(path), Some(folder), _) => Ok(folder.join(path)),
            (Ok(_), None, _) => Err(refused(
                "names a file, but the glTF came without a folder; load it by path, or embed the data",
            )),
            (Err(LEADS_OUT), Some(folder), Some(root)) => below(uri, folder, root).map_err(refused),
            (Err(problem), ..) => Err(refused(problem)),
        }
    }
}

/// Why a URI that leaves the folder of the glTF file is refused.
const LEADS_OUT: &str = "leads out of the folder of the glTF file; put the file beside it, or name a folder that holds both as the root \
                         (--root DIR, LoadOptions::root)";

/// The file that a URI leaving the glTF file's folder refers to, if it is below `root` after symbolic links
/// are resolved.
fn below(uri: &str, folder: &Path, root: &Path) -> Result<PathBuf, &'static str> {
    let decoded = percent_decoded(uri).and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default();
    let relative: PathBuf = decoded.split(['/', '\\']).filter(|part| !part.contains(':')).collect();
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let real = std::fs::canonicalize(folder.join(relative));
    match (real, std::fs::canonicalize(root)) {
        (Ok(file), Ok(root)) if file.starts_with(&root) => Ok(file),
        (Ok(_), Ok(_)) => {
            Err("leads out of the root that is allowed; name a folder that holds it with --root DIR")
        }
        (Err(_), _) => Err("names a file that does not exist or cannot be reached"),
        (_, Err(_)) => Err("cannot be followed, as the root does not exist; name another with --root DIR"),
    }
}

/// The bytes of a data URI or of the file that a URI refers to.
pub(crate) fn fetch(uri: &str, base: Base<'_>, place: &str) -> Result<Vec<u8>, LoadProblem> {
    let refused = |problem: &str| LoadProblem::Uri {
        place: place.to_owned(),
        uri: shortened(uri).to_owned(),
        problem: problem.to_owned(),
    };
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((kind, payload)) = data.split_once(',') else {
            return Err(refused("has no comma before its data; embed the bytes as data:…;base64,…"));
        };
        return if kind.ends_with(";base64") {
            decode_base64(payload.as_bytes())
                .ok_or_else(|| refused("is not valid base64; export the file again"))
        } else {
            percent_decoded(payload)
                .ok_or_else(|| refused("has a broken percent escape; export the file again"))
        };
    }
    read(&base.file(uri, place)?)
}

/// Reads a file, which must be a regular one.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, LoadProblem> {
    let failed = |source| LoadProblem::Read { path: path.to_owned(), source };
    let metadata = std::fs::metadata(path).map_err(failed)?;
    if !metadata.is_file() {
        // Reading a pipe or device might never end.
        return Err(failed(std::io::Error::new(std::io::ErrorKind::InvalidInput, "not an ordinary file")));
    }
    std::fs::read(path).map_err(failed)
}

/// Decodes a URI reference to a relative path, or returns the reason why it must not be followed.
pub(crate) fn relative(uri: &str) -> Result<PathBuf, &'static str> {
    let scheme = uri.split(['/', '?', '#']).next().is_some_and(|start| start.contains(':'));
    if scheme {
        return Err(
            "has a scheme that is not followed; download the file and name it relatively, or embed it",
        );
    }
    let Some(decoded) = percent_decoded(uri).and_then(|bytes| String::from_utf8(bytes).ok()) else {
        return Err("has a broken percent escape; escape special characters as %XX in UTF-8");
    };
    if decoded.is_empty() || decoded.contains('\0') {
        return Err("names no file; name one relatively, or embed the data");
    }
    if decoded.starts_with(['/', '\\']) {
        return Err("is an absolute path; put the file beside the glTF file and name it relatively");
    }
    let mut path = PathBuf::new();
    for part in decoded.split(['/', '\\']) {
        match part {
            "" | "." => {}
            ".." => return Err(LEADS_OUT),
            // On Windows, a part such as `C:` would replace the whole path.
            part if part.contains(':') => return Err(LEADS_OUT),
            part => path.push(part),
        }
    }
    if path.as_os_str().is_empty() {
        Err("names no file; name one relatively, or embed the data")
    } else {
        Ok(path)
    }
}

fn percent_decoded(text: &str) -> Option<Vec<u8>> {
    let mut bytes = text.bytes();
    let mut decoded = Vec::new();
    while let Some(byte) = bytes.next() {
        if byte == b'%' {
            let digit = |byte: u8| char::from(byte).to_digit(16);
            let (high, low) = (digit(bytes.next()?)?, digit(bytes.next()?)?);
            decoded.push((high * 16 + low) as u8);
        } else {
            decoded.push(byte);
        }
    }
    Some(decoded)
}

/// Encodes a file name as a URI reference. Everything except unreserved characters is escaped (RFC 3986).
pub(crate) fn percent_encoded(name: &str) -> String {
    name.bytes().fold(String::new(), |mut encoded, byte| {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            encoded.push(char::from(byte));
        } else {
            encoded.push_str(&format!("%{byte:02X}"));
        }
        encoded
    })
}

/// Encodes a relative path as a URI reference, each part as in [`percent_encoded`].
pub(crate) fn percent_encoded_path(path: &Path) -> String {
    let parts = path.iter().map(|part| percent_encoded(&part.to_string_lossy()));
    parts.collect::<Vec<_>>().join("/")
}

/// Encodes bytes as base64 (RFC 4648) in the standard alphabet, with padding.
pub(crate) fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let byte = |at: usize| u32::from(group.get(at).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for place in 0..4 {
            let digit = ALPHABET[(bits >> (18 - 6 * place) & 63) as usize];
            text.push(if place <= group.len() { char::from(digit) } else { '=' });
        }
    }
    text
}

/// Decodes base64 (RFC 4648) in the standard or URL-safe alphabet, with or without padding.
fn decode_base64(text: &[u8]) -> Option<Vec<u8>> {
    let end = text.len() - text.iter().rev().take_while(|&&byte| byte == b'=').count().min(2);
    let mut decoded = Vec::new();
    for group in text[..end].chunks(4) {
        let mut bits = 0u32;
        for &byte in group {
            let value = match byte {
                b'A'..=b'Z' => byte - b'A',
                b'a'..=b'z' => byte - b'a' + 26,
                b'0'..=b'9' => byte - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(value);
        }
        bits <<= 6 * (4 - group.len());
        let count = match group.len() {
            4 => 3,
            3 => 2,
            2 => 1,
            _ => return None,
        };
        decoded.extend_from_slice(&bits.to_be_bytes()[1..1 + count]);
    }
    Some(decoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vectors_of_rfc_4648() {
        let vectors = [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg", "foob"),
            ("Zm9vYmFy", "foobar"),
        ];
        for (encoded, plain) in vectors {
            assert_eq!(decode_base64(encoded.as_bytes()).unwrap(), plain.as_bytes());
            assert_eq!(base64(plain.as_bytes()).trim_end_matches('='), encoded.trim_end_matches('='));
            assert!(base64(plain.as_bytes()).len().is_multiple_of(4));
        }
        let all: Vec<u8> = (0..=255).collect();
        assert_eq!(decode_base64(base64(&all).as_bytes()).unwrap(), all);
        assert_eq!(decode_base64(b"A"), None);
        assert_eq!(decode_base64(b"Zg=\n"), None);
    }

    #[test]
    fn only_files_beside_are_named() {
        assert_eq!(relative("a%20b/c.bin").unwrap(), Path::new("a b/c.bin"));
        assert_eq!(relative("./c.bin").unwrap(), Path::new("c.bin"));
        for refused in [
            "../c.bin",
            "a/../../c",
            "%2e%2e/c",
            "a\\..\\c",
            "/etc/c",
            "\\c",
            "http://x/c",
            "file:c",
            "C:\\c",
            "",
            "%",
            "%zz",
            "%00",
        ] {
            assert!(relative(refused).is_err(), "{refused}");
        }
        assert_eq!(relative(&percent_encoded("ä b%.exr")).unwrap(), Path::new("ä b%.exr"));
    }

    #[test]
    fn data_uris() {
        assert_eq!(fetch("data:application/octet-stream;base64,Zm9v", Base::default(), "x").unwrap(), b"foo");
        assert_eq!(fetch("data:,a%20b", Base::default(), "x").unwrap(), b"a b");
        assert!(fetch("data:;base64", Base::default(), "x").is_err());
        assert!(fetch("x.bin", Base::default(), "x").is_err());
    }

    #[test]
    fn a_root_lets_files_around_be_named() {
        let place = tempfile::tempdir().unwrap();
        let (level, textures) =
            (place.path().join("project/levels"), place.path().join("project/my textures"));
        for folder in [&level, &textures] {
            std::fs::create_dir_all(folder).unwrap();
        }
        std::fs::write(textures.join("wall.png"), "wall").unwrap();
        std::fs::write(place.path().join("secret"), "secret").unwrap();
        let uri = "../my%20textures/wall.png";
        let (project, root) = (place.path().join("project"), place.path());
        let missing = project.join("no such folder");
        let allowed = |root| Base { folder: Some(&level), root: Some(root) };
        assert_eq!(fetch(uri, allowed(&project), "x").unwrap(), b"wall");
        assert_eq!(fetch("../../secret", allowed(root), "x").unwrap(), b"secret");
        for (uri, base, said) in [
            (uri, Base { folder: Some(&level), root: None }, "--root"),
            ("../../secret", allowed(&project), "out of the root"),
            ("../levels/../../secret", allowed(&project), "out of the root"),
            ("../nothing", allowed(&project), "does not exist"),
            (uri, allowed(&missing), "root does not exist"),
            ("/etc/passwd", allowed(Path::new("/")), "absolute"),
        ] {
            let error = fetch(uri, base, "x").unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(place.path(), project.join("link")).unwrap();
            assert!(fetch("../link/secret", allowed(&project), "x").is_err());
        }
    }
}
