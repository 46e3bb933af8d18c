//! Which object each triangle of the scene belongs to. A ray asks this for the triangle that it hits: in a table of
//! a few bits for each triangle, which stays in the cache, because a record for each triangle of a fine mesh would come
//! from memory.

/// The objects of triangles that are numbered object by object.
#[derive(Debug)]
pub(crate) struct Owners {
    /// Number of the first triangle of each object, and after those of the last one, the number of all.
    first: Vec<u32>,
    /// The object of every `STRIDE`-th triangle.
    objects: Vec<u32>,
}

/// From one triangle whose object is looked up to the next.
const STRIDE: usize = 8;

impl Owners {
    /// Creates the table from the number of triangles of each object, 0 for those without any.
    pub fn new(counts: &[u32]) -> Self {
        let mut owners = Self { first: Vec::with_capacity(counts.len() + 1), objects: Vec::new() };
        let mut first = 0;
        for (object, count) in (0u32..).zip(counts) {
            owners.first.push(first);
            first += count;
            owners.objects.resize((first as usize).div_ceil(STRIDE), object);
        }
        owners.first.push(first);
        owners
    }

    /// Returns the object of a triangle, and the triangle's index there.
    #[inline]
    pub fn of(&self, triangle: u32) -> (usize, u32) {
        let mut object = self.objects[triangle as usize / STRIDE] as usize;
        while self.first[object + 1] <= triangle {
            object += 1;
        }
        (object, triangle - self.first[object])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_triangle_belongs_to_the_object_that_lists_it() {
        let counts = [0, 3, 1, 0, 0, 40, 1, 1, 8, 0, 3, 16, 0];
        let owners = Owners::new(&counts);
        let mut triangle = 0;
        for (object, &count) in counts.iter().enumerate() {
            for number in 0..count {
                assert_eq!(owners.of(triangle), (object, number), "triangle {triangle}");
                triangle += 1;
            }
        }
        assert_eq!(triangle, 73);
    }
}
