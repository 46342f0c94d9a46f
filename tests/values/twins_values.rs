//! The twins themselves against values worked out by hand.

mod item_groups {
    use crate::twins::item_groups::*;
    use glam::*;

    #[test]
    fn a_wall_is_one_group_and_a_corner_three() {
        let wall = |normal, material| Listed { normal, material, shares: true };
        let tilted = DVec3::new(1.0, 0.2, -0.2);
        assert_eq!(groups(&[wall(DVec3::X, 0), wall(tilted, 0), wall(DVec3::X * 9.0, 0)]), [vec![0, 1, 2]]);
        assert_eq!(groups(&[wall(DVec3::X, 0), wall(DVec3::Y, 0), wall(-DVec3::X, 0)]).len(), 3);
        assert_eq!(groups(&[wall(DVec3::X, 1), wall(DVec3::X, 0), wall(DVec3::X, 1)]), [vec![1], vec![0], vec![2]]);
        let masked = Listed { shares: false, ..wall(DVec3::X, 0) };
        assert_eq!(groups(&[masked, wall(DVec3::X, 1), wall(DVec3::X, 1)]), [vec![1, 2], vec![0]]);
    }
}

mod closed_forms {
    use crate::twins::closed_forms::*;
    use glam::*;
    use std::f64::consts::PI;

    #[test]
    fn lambert_agrees_with_integration_over_the_polygon() {
        // A 2×1 wall standing beside the point, and a ceiling above it off centre.
        let wall = [DVec3::new(0.3, 0.0, -1.0), DVec3::X * 0.6, DVec3::Y * 2.0];
        let ceiling = [DVec3::new(-0.2, 0.7, -0.4), DVec3::X * 1.5, DVec3::Z * 0.9];
        for [corner, u, v] in [wall, ceiling] {
            let polygon = [corner, corner + u, corner + u + v, corner + v];
            let n = 400;
            let area_normal = u.cross(v) / (n * n) as f64;
            let mut sum = 0.0;
            for i in 0..n * n {
                let (a, b) = ((i % n) as f64 + 0.5, (i / n) as f64 + 0.5);
                let r = corner + u * (a / n as f64) + v * (b / n as f64);
                sum += r.y * r.dot(area_normal).abs() / (PI * r.length_squared().powi(2));
            }
            // The midpoint rule's error at 400².
            assert!((sum - form_factor(DVec3::ZERO, DVec3::Y, &polygon)).abs() < 1e-5);
        }
    }

    #[test]
    fn a_large_ceiling_covers_everything_and_a_tall_long_wall_half() {
        let far = 1e6;
        let ceiling =
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| DVec3::new(x * far, 1.0, z * far));
        assert!(ambient_occlusion(DVec3::ZERO, DVec3::Y, &ceiling) < 1e-5);
        let wall = [(0.0, -far), (far, -far), (far, far), (0.0, far)].map(|(y, z)| DVec3::new(1e-3, y, z));
        assert!((ambient_occlusion(DVec3::ZERO, DVec3::Y, &wall) - 0.5).abs() < 1e-5);
    }

    #[test]
    fn the_furnace_is_a_geometric_series() {
        assert_eq!([furnace(0.5, 0), furnace(0.5, 1), furnace(0.5, 2)], [1.0, 1.5, 1.75]);
        assert!((furnace(0.8, 200) - 5.0).abs() < 1e-12);
    }
}

mod shade {
    use crate::twins::shade::*;
    use glam::*;
    use twobounce::gi::cones::choices::Fill;

    const RED: Vec3 = Vec3::new(2.0, 0.0, 0.0);
    const BLUE: Vec3 = Vec3::new(0.0, 0.0, 1.0);
    const WALL: Shaded = Shaded { normal: Vec3::X, front: RED, back: None, opacity: 1.0, area: 0.5 };

    #[test]
    fn a_surface_that_faces_x_shows_to_travellers_along_minus_x() {
        let facing = fill(&[WALL], Fill::Facing);
        assert_eq!(facing[3], RED.extend(1.0));
        // From behind it is black and blocks; along its plane it is neither visible nor an occluder.
        assert_eq!((facing[0], facing[1]), (Vec4::W, Vec4::ZERO));
        assert_eq!(fill(&[WALL], Fill::Coverage)[3], (0.5 * RED).extend(0.5));
        assert_eq!(fill(&[WALL], Fill::Uniform), [RED.extend(1.0); 7]);
    }

    #[test]
    fn two_sides_keep_their_own_light() {
        let leaf = Shaded { back: Some(BLUE), opacity: 0.5, ..WALL };
        let facing = fill(&[leaf], Fill::Facing);
        assert_eq!((facing[3], facing[0]), ((0.5 * RED).extend(0.5), (0.5 * BLUE).extend(0.5)));
        assert_eq!(facing[6], (0.25 * (RED + BLUE)).extend(0.5));
        assert_eq!(fill(&[leaf], Fill::Coverage)[0], (0.25 * BLUE).extend(0.25));
    }

    #[test]
    fn uniform_is_one_colour_all_round() {
        let leaf = Shaded { back: Some(BLUE), opacity: 0.5, ..WALL };
        assert_eq!(fill(&[leaf], Fill::Uniform), [(0.5 * RED).extend(0.5); 7]);
        let floor = Shaded { normal: Vec3::Y, front: BLUE, opacity: 0.0, ..leaf };
        assert_eq!(fill(&[leaf, floor, WALL], Fill::Uniform), [(0.5 * RED).extend(0.5); 7]);
    }

    #[test]
    fn front_has_nothing_behind_a_surface_and_divides_by_the_number() {
        let leaf = Shaded { normal: Vec3::new(0.6, 0.8, 0.0), back: Some(BLUE), opacity: 0.5, ..WALL };
        let alone = fill(&[leaf], Fill::Front);
        let close = |a: Vec4, b: Vec4| (a - b).abs().max_element() < 1e-6; // f32
        assert!(close(alone[3], (0.3 * RED).extend(0.3)) && close(alone[4], (0.4 * RED).extend(0.4)), "{alone:?}");
        assert_eq!([alone[0], alone[1], alone[2], alone[5]], [Vec4::ZERO; 4]);
        assert_eq!(alone[6], (0.5 * RED).extend(0.5));
        assert!(close(fill(&[leaf, WALL], Fill::Front)[3], (0.65 * RED).extend(0.65)));
    }

    #[test]
    fn no_order_and_no_number_of_triangles_makes_more_than_opaque() {
        let tilted = Shaded { normal: Vec3::ONE.normalize(), front: BLUE, back: Some(RED), opacity: 0.7, area: 1.3 };
        for how in Fill::ALL {
            let (a, b) = (fill(&[WALL, tilted, WALL], *how), fill(&[WALL, WALL, tilted], *how));
            for (a, b) in a.iter().zip(&b) {
                // f32 sums in two orders.
                assert!((*a - *b).abs().max_element() < 1e-6);
                assert!(a.w <= 1.0 && a.truncate().max_element() <= 2.0 * a.w + 1e-6);
            }
        }
    }
}

mod volume {
    use crate::twins::volume::*;
    use glam::*;
    use twobounce::vk::SamplerAddressMode;

    /// A 2³ chain whose level-0 target 0 is x, and whose level 1 is 5.
    fn ramp() -> Volume {
        let zero = |n: usize| std::array::from_fn(|_| vec![Vec4::ZERO; n]);
        let (mut fine, mut coarse): (Level, Level) = (zero(8), zero(1));
        for (i, v) in fine[0].iter_mut().enumerate() {
            *v = Vec4::splat((i & 1) as f32);
        }
        coarse[0][0] = Vec4::splat(5.0);
        Volume::new(vec![fine, coarse])
    }

    #[test]
    fn sampling_is_linear_in_space_and_in_level() {
        let v = ramp();
        let at = |x, level| v.sample(0, Vec3::new(x, 0.5, 0.5), level, SamplerAddressMode::CLAMP_TO_EDGE).x;
        assert_eq!([at(0.25, 0.0), at(0.5, 0.0), at(0.75, 0.0)], [0.0, 0.5, 1.0]);
        assert_eq!([at(0.5, 0.5), at(0.5, 1.0), at(0.5, 9.0)], [2.75, 5.0, 5.0]);
    }

    #[test]
    fn beyond_the_border_is_the_edge_or_nothing_or_the_grid_again() {
        let v = ramp();
        let at = |border| [1.0, 3.0].map(|x| v.sample(0, Vec3::new(x, 0.5, 0.5), 0.0, border).x);
        assert_eq!(at(SamplerAddressMode::CLAMP_TO_EDGE), [1.0, 1.0]);
        assert_eq!(at(SamplerAddressMode::CLAMP_TO_BORDER), [0.5, 0.0]);
        assert_eq!(at(SamplerAddressMode::REPEAT), [0.5, 0.5]);
    }

    #[test]
    fn a_half_keeps_eleven_bits() {
        assert_eq!(round_to_half(Vec4::new(1.0 + 1.0 / 4096.0, 2049.0, 65504.0, 6e-8)), {
            Vec4::new(1.0, 2048.0, 65504.0, 5.9604645e-8)
        });
    }
}

mod voxelise {
    use crate::twins::voxelise::*;
    use glam::*;

    const HALF: [DVec3; 3] = [DVec3::new(0.0, 0.0, 0.5), DVec3::new(1.0, 0.0, 0.5), DVec3::new(0.0, 1.0, 0.5)];

    #[test]
    fn clipping_keeps_area_and_centroid() {
        let whole = Polygon::clipped(&HALF, DVec3::ZERO, DVec3::ONE);
        assert_eq!(whole.area_vector(), DVec3::new(0.0, 0.0, 0.5));
        assert!((whole.centroid() - DVec3::new(1.0, 1.0, 1.5) / 3.0).length() < 1e-15);
        assert_eq!(coverage(&HALF, IVec3::ZERO), DVec3::new(0.0, 0.0, 0.5));
    }

    #[test]
    fn the_parts_in_all_voxels_make_the_whole() {
        let triangle = [DVec3::new(0.3, 0.2, 0.1), DVec3::new(7.9, 3.3, 2.7), DVec3::new(1.2, 6.8, 7.7)];
        let pairs = voxelise(&[triangle], 8);
        let sum: f64 = pairs
            .certain
            .iter()
            .map(|&(v, _)| {
                let v = v as i32;
                let voxel = IVec3::new(v % 8, v / 8 % 8, v / 64).as_dvec3();
                Polygon::clipped(&triangle, voxel, voxel + 1.0).area_vector().length()
            })
            .sum();
        let area = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).length() / 2.0;
        // The tolerance covers the touching voxels, which hold slivers thinner than the band.
        assert!((sum - area).abs() < 1e-3 * area, "{sum} of {area}");
    }

    #[test]
    fn the_hierarchy_misses_nothing_that_testing_every_voxel_finds() {
        let mut triangles = vec![HALF.map(|p| p * 7.3 + 0.31)];
        // A needle, an edge-on quad's half, one smaller than a voxel; one without area is listed nowhere.
        triangles.push([DVec3::new(0.1, 0.2, 0.3), DVec3::new(7.7, 6.9, 7.2), DVec3::new(7.7, 6.9001, 7.2)]);
        triangles.push([DVec3::new(2.5, 0.5, 0.5), DVec3::new(2.5, 7.5, 0.5), DVec3::new(2.5, 0.5, 7.5)]);
        triangles.push([DVec3::new(4.2, 4.3, 4.4), DVec3::new(4.3, 4.3, 4.4), DVec3::new(4.2, 4.4, 4.4)]);
        let with_flat = [triangles.as_slice(), &[[DVec3::splat(3.5); 3]]].concat();
        let pairs = voxelise(&with_flat, 8);
        let mut every = Vec::new();
        for voxel in 0..512 {
            let min = IVec3::new(voxel % 8, voxel / 8 % 8, voxel / 64).as_dvec3();
            for (i, t) in triangles.iter().enumerate() {
                if !Polygon::clipped(t, min + TOUCHING_VOXELS, min + 1.0 - TOUCHING_VOXELS).corners.is_empty() {
                    every.push((voxel as u32, i as u32));
                }
            }
        }
        assert_eq!(pairs.certain, every);
        assert_eq!(pairs.certain.iter().filter(|p| p.1 >= 3).count(), 1);
    }

    #[test]
    fn a_triangle_in_a_face_touches_both_voxels() {
        let pairs = voxelise(&[HALF.map(|p| p * 0.5 + DVec3::new(0.1, 0.1, 0.75))], 2);
        assert_eq!((pairs.certain, pairs.touching), (vec![], vec![(0, 0), (4, 0)]));
    }

    #[test]
    fn the_comparison_sees_what_is_missing_extra_or_double() {
        let exact = VoxelPairs { certain: vec![(0, 0), (1, 0)], touching: vec![(2, 0)] };
        let of = |found: &[Pair]| {
            let c = compare_sets(found, &exact);
            (c.recall, c.precision)
        };
        assert_eq!(of(&[(1, 0), (0, 0)]), (1.0, 1.0));
        assert_eq!(of(&[(0, 0), (1, 0), (2, 0)]), (1.0, 1.0));
        assert_eq!(of(&[(0, 0)]), (0.5, 1.0));
        assert_eq!(of(&[(0, 0), (1, 0), (3, 0)]), (1.0, 2.0 / 3.0));
        assert_eq!(of(&[(0, 0), (1, 0), (1, 0)]), (1.0, 2.0 / 3.0));
    }
}
