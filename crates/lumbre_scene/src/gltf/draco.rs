//! Decodes Draco data with the crate `draco-core`, within limits set by the caller.
//!
//! `draco-core` has no unsafe code, checks its limits before it allocates, and decoded hundreds of thousands
//! of damaged meshes without a panic. A panic would be caught here all the same.

/// Largest total size in bytes of the attributes of a vertex, including those the glTF file does not refer
/// to: sixteen attributes of four floats.
pub(crate) const MAX_BYTES_PER_POINT: usize = 16 * 16;

#[cfg(feature = "draco")]
pub(crate) use with_decoder::decode;
#[cfg(not(feature = "draco"))]
pub(crate) use without_decoder::decode;

#[cfg(feature = "draco")]
mod with_decoder {
    use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute, PointIndex};

    use super::MAX_BYTES_PER_POINT;
    use crate::gltf::accessor_format::{
        BYTE, FLOAT, Format, SHORT, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT,
    };
    use crate::gltf::guarded::guarded;

    /// A decoded mesh.
    pub(crate) struct DracoMesh(Mesh);

    /// Decodes a mesh of at most this many points and triangles; a larger one is refused before it is
    /// decoded.
    pub(crate) fn decode(bytes: &[u8], points: u64, triangles: u64) -> Result<DracoMesh, String> {
        let limits = DecodeLimits::default()
            .with_max_points(points)
            .with_max_faces(triangles)
            .with_max_decoded_bytes(points.saturating_mul(MAX_BYTES_PER_POINT as u64));
        let decode = || {
            let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
            let mut mesh = Mesh::new();
            MeshDecoder::new().decode(&mut buffer, &mut mesh).map(|()| mesh)
        };
        match guarded(decode) {
            Some(Ok(mesh)) => Ok(DracoMesh(mesh)),
            Some(Err(error)) => Err(format!("its Draco data cannot be decoded: {error}")),
            None => Err("its Draco data make the decoder fail".to_owned()),
        }
    }

    impl DracoMesh {
        pub(crate) fn points(&self) -> usize {
            self.0.num_points()
        }

        pub(crate) fn triangles(&self) -> usize {
            self.0.num_faces()
        }

        /// The vertex indices of the triangles, in the format of an accessor.
        pub(crate) fn indices(&self, format: Format) -> Result<Vec<u8>, String> {
            let mut elements = Vec::with_capacity(3 * self.triangles() * format.size());
            for corner in self.0.faces().iter().flatten() {
                write(&mut elements, Number::Whole(i64::from(corner.0)), format.component)?;
            }
            Ok(elements)
        }

        /// The values of an attribute at all points, in the format of an accessor.
        pub(crate) fn attribute(&self, number: u32, format: Format) -> Result<Vec<u8>, String> {
            let attribute = self.0.attribute_by_unique_id(number).ok_or_else(|| {
                format!("attribute {number} is not in its Draco data; export the file again")
            })?;
            let components = usize::from(attribute.num_components());
            if components != format.components {
                return Err(format!(
                    "its type has {} numbers, but its Draco data have {components}; export the file again",
                    format.components
                ));
            }
            let mut elements = Vec::with_capacity(self.points() * format.size());
            for point in 0..self.points() {
                let value = value(attribute, point).ok_or("its Draco data leave a vertex without a value")?;
                if component(attribute.data_type()) == Some(format.component) {
                    elements.extend_from_slice(value);
                    continue;
                }
                for bytes in value.chunks_exact(attribute.data_type().byte_length()) {
                    write(&mut elements, Number::read(bytes, attribute)?, format.component)?;
                }
            }
            Ok(elements)
        }
    }

    /// The bytes of an attribute at one point.
    fn value(attribute: &PointAttribute, point: usize) -> Option<&[u8]> {
        let entry = attribute.mapped_index(PointIndex(u32::try_from(point).ok()?)).0 as usize;
        let size = attribute.data_type().byte_length() * usize::from(attribute.num_components());
        let start = entry.checked_mul(usize::try_from(attribute.byte_stride()).ok()?)?;
        attribute.buffer().data().get(start..start.checked_add(size)?)
    }

    /// The glTF component type of a Draco data type, if glTF has one.
    fn component(data_type: DataType) -> Option<u32> {
        match data_type {
            DataType::Int8 => Some(BYTE),
            DataType::Uint8 | DataType::Bool => Some(UNSIGNED_BYTE),
            DataType::Int16 => Some(SHORT),
            DataType::Uint16 => Some(UNSIGNED_SHORT),
            DataType::Uint32 => Some(UNSIGNED_INT),
            DataType::Float32 => Some(FLOAT),
            _ => None,
        }
    }

    /// A number to be converted, where the accessor's component type differs from the type in the data.
    #[derive(Clone, Copy)]
    enum Number {
        Whole(i64),
        Real(f64),
    }

    impl Number {
        fn read(bytes: &[u8], attribute: &PointAttribute) -> Result<Self, String> {
            let mut wide = [0; 8];
            wide.get_mut(..bytes.len()).ok_or("its numbers are too wide")?.copy_from_slice(bytes);
            let whole = i64::from_le_bytes(wide);
            let unused = 64 - 8 * bytes.len() as u32;
            Ok(match attribute.data_type() {
                DataType::Float32 => Self::Real(f64::from(f32::from_bits(whole as u32))),
                DataType::Float64 => Self::Real(f64::from_bits(whole as u64)),
                DataType::Int8 | DataType::Int16 | DataType::Int32 => Self::Whole(whole << unused >> unused),
                _ => Self::Whole(whole),
            })
        }
    }

    /// Writes a number in the component type of an accessor, or fails if it does not fit.
    fn write(elements: &mut Vec<u8>, number: Number, component: u32) -> Result<(), String> {
        let too_large = || "has a number in its Draco data that its componentType cannot hold".to_owned();
        let whole = match number {
            Number::Real(real) if component == FLOAT => {
                elements.extend_from_slice(&(real as f32).to_le_bytes());
                return Ok(());
            }
            Number::Whole(whole) if component == FLOAT => {
                elements.extend_from_slice(&(whole as f32).to_le_bytes());
                return Ok(());
            }
            Number::Real(_) => {
                return Err("has real numbers in its Draco data, but a componentType of integers".to_owned());
            }
            Number::Whole(whole) => whole,
        };
        match component {
            BYTE => elements.extend(i8::try_from(whole).map_err(|_| too_large())?.to_le_bytes()),
            UNSIGNED_BYTE => elements.extend(u8::try_from(whole).map_err(|_| too_large())?.to_le_bytes()),
            SHORT => elements.extend(i16::try_from(whole).map_err(|_| too_large())?.to_le_bytes()),
            UNSIGNED_SHORT => elements.extend(u16::try_from(whole).map_err(|_| too_large())?.to_le_bytes()),
            _ => elements.extend(u32::try_from(whole).map_err(|_| too_large())?.to_le_bytes()),
        }
        Ok(())
    }
}

#[cfg(not(feature = "draco"))]
mod without_decoder {
    use crate::gltf::accessor_format::Format;

    /// Has no values: without a decoder there are no meshes.
    pub(crate) enum DracoMesh {}

    pub(crate) fn decode(_: &[u8], _: u64, _: u64) -> Result<DracoMesh, String> {
        Err("this program has no decoder for Draco data".to_owned())
    }

    impl DracoMesh {
        pub(crate) fn points(&self) -> usize {
            match *self {}
        }

        pub(crate) fn triangles(&self) -> usize {
            match *self {}
        }

        pub(crate) fn indices(&self, _: Format) -> Result<Vec<u8>, String> {
            match *self {}
        }

        pub(crate) fn attribute(&self, _: u32, _: Format) -> Result<Vec<u8>, String> {
            match *self {}
        }
    }
}
