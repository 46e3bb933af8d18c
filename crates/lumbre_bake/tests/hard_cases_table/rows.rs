//! The rows of the table in their order. Each has a text on how the baker handles the case, with links to other tests.

/// The title of each row and its text.
pub const ROWS: [(&str, &str); 13] = [
    (
        "a ray hits the face it left, scenes of 1e-3 to 1e5 m",
        "A ray starts some ulps off its face (Wächter and Binder, Ray Tracing Gems, chapter 6), by the triangle's own size; every scene is brought to canonical units by a power of two. Also [scale](../crates/lumbre_rays/tests/scale.rs) `rays_leave_their_surface_from_a_millimetre_to_a_hundred_kilometres`, `without_the_offset_rays_do_hit_the_surface_they_leave`, `scaling_by_a_power_of_two_changes_no_bit`, [sizes](../crates/lumbre_bake/tests/bake/hard_cases_of_size.rs) `no_ray_hits_the_face_it_left_from_a_millimetre_to_a_hundred_kilometres`, and [known answers](../crates/lumbre_bake/tests/bake/known_answers.rs) `the_same_bits_at_every_scale_of_two`.",
    ),
    (
        "rays through shared edges and T-junctions",
        "Watertight intersection (Woop, Benthin and Wald, JCGT 2(1), 2013): edges that share both ends round alike. At a T-junction the edges differ; what slips through is as rare as the slit is narrow, and in a closed room such a ray brings no light and is counted. Also [watertight](../crates/lumbre_rays/tests/watertight.rs) `ten_million_rays_stay_in_a_box`, `a_small_sphere_far_from_the_origin_and_axis_parallel_rays`.",
    ),
    (
        "texel centre inside other geometry, or outside its triangle",
        "A texel shows the part of its square that lies on its own triangles and not in a closed piece (rays that meet a back first tell); its value is moved to its centre along its neighbours' slope. Also [leaks](../crates/lumbre_bake/tests/bake/leaks.rs) `two_closed_boxes_share_a_wall`, `a_wall_of_zero_thickness_and_two_sides`, `a_wall_a_centimetre_thick_between_texels_of_five`, `a_floor_that_runs_through_under_the_wall_leaks_a_texel_at_most`, and [known answers](../crates/lumbre_bake/tests/bake/known_answers.rs) `no_texel_under_the_crate_darkens_its_rim`.",
    ),
    (
        "patches sharing an edge: the gap to 0",
        "Direct light is Lambert's polygon formula, which has no singularity. Between patches rays are held to the closed form, down to a shared edge: [form factors](../crates/lumbre_bake/src/radiosity/form_factor_tests.rs) `perpendicular_squares_down_to_a_shared_edge`, `parallel_squares`.",
    ),
    (
        "coplanar faces, a lamp in the ceiling's plane, duplicate triangles",
        "Of triangles in one place, turned the same way and found by a hash of their corners, light meets the emitter, else the first; turned opposite ways both stay. Also [duplicates](../crates/lumbre_bake/src/scene/duplicates.rs) `the_emitter_wins_else_the_first`.",
    ),
    (
        "slivers, zero area, NaN positions, NaN or zero normals",
        "Dropped, and named once by object; a normal that is none is the face's own. Also [closest hit](../crates/lumbre_rays/tests/closest_hit.rs) `degenerate_triangles_are_skipped_and_indices_kept`, `senseless_rays_hit_nothing`.",
    ),
    (
        "rho towards 1, rho above 1 in the file",
        "Clamped to 0.999 with a warning; the report has the residual and residual / (1 - rho), a bound on the solution's error. Also [solver](../crates/lumbre_bake/src/radiosity/solver.rs) `furnace`, `iterations_stay_within_their_bounds`.",
    ),
    (
        "row sums of Monte Carlo form factors above 1; reciprocity lost",
        "Hits of both directions are pooled, so that A_i F_ij = A_j F_ji to the bit, and scaled alike for both until every row sums to what its patch sees. Also [form factors](../crates/lumbre_bake/src/radiosity/form_factor_tests.rs) `a_closed_room_is_reciprocal_and_its_rows_sum_to_one`.",
    ),
    (
        "tiny bright emitters (fireflies)",
        "Emitters are sampled themselves, in direct light and in what bounces; a shadow ray ends sixteen roundings of its length before its lamp, or it would meet a small lamp seen from afar; no sample is clamped, so that no energy is lost but what the report calls lost. Also [emitters](../crates/lumbre_bake/tests/bake/emitters.rs) `a_tiny_bright_emitter`, `no_fireflies_of_a_tiny_emitter`, and [sizes](../crates/lumbre_bake/tests/bake/hard_cases_of_size.rs) `a_lamp_a_thousandth_of_the_room_gives_all_its_light_and_no_sparks`.",
    ),
    (
        "overlapping or out-of-range UVs; texels with no coverage; charts under a texel",
        "The mesh is named and unwrapped anew; coverage is conservative, values are continued into the gap. Also [validation](../crates/lumbre_mesh/src/uv_validation.rs) `every_fault_names_its_triangles`, [atlas](../crates/lumbre_mesh/tests/atlas.rs) `no_overlap`, `the_check_sees_a_gap_that_is_too_small`, [unwrap](../crates/lumbre_mesh/tests/unwrap.rs) `triangles_without_area_share_a_spot`, [sizes](../crates/lumbre_bake/tests/bake/hard_cases_of_size.rs) `coordinates_out_of_range_and_overlapping_are_named_and_replaced`, `charts_below_a_texel_have_light`, and [filling](../crates/lumbre_bake/src/finish/fill.rs) `a_plane_is_continued_exactly_and_moved_to_the_centres`.",
    ),
    (
        "sums over 10^8 samples, light ratios of 10^8; RGB9E5 saturates at 65408",
        "Sums over a scene are f64 or counts of 64 bits; the longest sum in f32 is that of one texel's samples. What an encoding costs is in the report of each file. Also [emitters](../crates/lumbre_bake/tests/bake/emitters.rs) `light_ratios_of_a_hundred_million`, `bright_and_dim_lights_side_by_side`, [sizes](../crates/lumbre_bake/tests/bake/hard_cases_of_size.rs) `a_room_lit_a_hundred_million_times_less_than_its_neighbour_is_as_bright_as_alone`, [lightmap files](../crates/lumbre_scene/tests/lightmap_files.rs) `rounding_keeps_the_energy`, `what_does_not_fit_is_reported`, and [RGB9E5](../crates/lumbre_scene/src/lightmap_files/shared_exponent.rs) `every_code_decodes_and_encodes_to_the_same_color`, `the_nearest_color_within_the_closed_bound`.",
    ),
    (
        "kill -9 in the middle, disk full, no permission, an output that exists",
        "What is computed is kept in a checkpoint; files are written beside their names and renamed. The command itself is killed, starved and refused in [the command](../crates/lumbre/tests/bake_command.rs) `killed_again_and_again_it_ends_with_the_same_bytes`, `an_interruption_keeps_the_work_and_says_how_to_go_on`, `a_full_disk_leaves_nothing_half_written`, `what_cannot_work_is_said_before_the_bake`, `a_folder_that_takes_no_files_is_said_before_the_bake`, `an_unchanged_level_is_left_as_it_is`. Also [checkpoints](../crates/lumbre_bake/tests/bake/checkpoint.rs) `resumed_after_any_interruption_it_ends_with_the_same_bits`, `whatever_became_of_the_file_the_bits_are_the_same`.",
    ),
    (
        "malformed glTF",
        "A typed error that names the accessor, view, node or extension; nothing is allocated by a count that the file cannot back. Also [refused](../crates/lumbre_scene/tests/refused.rs) `containers`, `buffers`, `accessors`, `hierarchies`, `extensions`, `images`, and [mutants](../crates/lumbre_scene/tests/mutants.rs) `no_mutant_panics_hangs_or_fills_the_memory`, `no_damaged_lightmap_panics`.",
    ),
];
