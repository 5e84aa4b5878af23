//! A furnished room: convexity (H1) fails here as it does in real rooms.

use super::{Ball, Block, Cylinder, Primitive, Rectangle, Room, Scene, Shape, Texture};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Inner corners of the room, metres: 6.0 x 2.7 x 5.4 m, the floor 1.3 m below the origin.
const ROOM_MIN: [f64; 3] = [-3.0, -1.4, -2.7];
const ROOM_MAX: [f64; 3] = [3.0, 1.3, 2.7];
const FLOOR: f64 = ROOM_MAX[1];
/// How far posters hang before the wall, metres.
const POSTER_GAP: f64 = 0.004;

impl Scene {
    /// A living room of 6.0 x 2.7 x 5.4 m around the origin with some twenty pieces: table, chairs,
    /// shelves, cupboards, sofa, lamps, balls, posters. The furniture stands within 0.8 m of the
    /// walls and within 0.85 m of the vertical through the origin (a table, lower than the
    /// origin), so that a camera can walk around the table. The seed moves, turns and paints it.
    pub fn furnished_room(seed: u64) -> Self {
        let mut furnisher = Furnisher {
            rng: ChaCha8Rng::seed_from_u64(seed),
            primitives: Vec::new(),
        };
        furnisher.walls();
        furnisher.ceiling();
        furnisher.table();
        furnisher.back_wall();
        furnisher.front_wall();
        furnisher.left_wall();
        furnisher.right_wall();
        Self {
            primitives: furnisher.primitives,
            shading: 0.35,
        }
    }
}

struct Furnisher {
    rng: ChaCha8Rng,
    primitives: Vec<Primitive>,
}

impl Furnisher {
    /// A small random shift or turn in [-size, size].
    fn jitter(&mut self, size: f64) -> f64 {
        self.rng.random_range(-size..=size)
    }

    fn seed(&mut self) -> u64 {
        self.rng.random()
    }

    fn put(&mut self, shape: impl Into<Shape>, texture: Texture) {
        self.primitives.push(Primitive::new(shape, texture));
    }

    /// A box standing on the height `base`, `size` = width, height, length.
    fn block(&mut self, [x, base, z]: [f64; 3], size: [f64; 3], yaw_rad: f64, texture: Texture) {
        let half_size_m = 0.5 * Vector3::from(size);
        let centre = Vector3::new(x, base - half_size_m.y, z);
        self.put(Block::new(centre, half_size_m, yaw_rad), texture);
    }

    fn ball(&mut self, [x, base, z]: [f64; 3], radius_m: f64, texture: Texture) {
        let centre = Vector3::new(x, base - radius_m, z);
        self.put(Ball { centre, radius_m }, texture);
    }

    fn cylinder(&mut self, [x, base, z]: [f64; 3], radius_m: f64, height: f64, texture: Texture) {
        let half_height_m = 0.5 * height;
        let cylinder = Cylinder {
            centre: Vector3::new(x, base - half_height_m, z),
            radius_m,
            half_height_m,
        };
        self.put(cylinder, texture);
    }

    /// A picture of `width` x `height` on a wall whose inward normal is `inward`.
    fn poster(&mut self, centre: [f64; 3], inward: Vector3<f64>, size: [f64; 2], cell_m: f64) {
        let along = Vector3::y().cross(&inward);
        let rgb = [120.0, 125.0, 118.0].map(|c| c + self.jitter(20.0));
        let texture = Texture::Mosaic {
            size_m: cell_m,
            octaves: 3,
            softness: 0.06,
            rgb,
            spread: [115.0; 3],
            solid: false,
            seed: self.seed(),
        };
        let (half_u, half_v) = (along * (0.5 * size[0]), Vector3::y() * (0.5 * size[1]));
        let middle = Vector3::from(centre) + inward * POSTER_GAP;
        self.put(Rectangle::new(middle, half_u, half_v), texture);
    }

    /// Flat random tiles along the surface.
    fn tiles(&mut self, size_m: f64, rgb: [f64; 3], spread: f64) -> Texture {
        Texture::Mosaic {
            size_m,
            octaves: 3,
            softness: 0.08,
            rgb,
            spread: [spread; 3],
            solid: false,
            seed: self.seed(),
        }
    }

    /// Marble: cells in space, for round things.
    fn marble(&mut self, size_m: f64, rgb: [f64; 3], spread: f64) -> Texture {
        Texture::Mosaic {
            size_m,
            octaves: 3,
            softness: 0.25,
            rgb,
            spread: [spread; 3],
            solid: true,
            seed: self.seed(),
        }
    }

    /// Wood: long planks.
    fn wood(&mut self, size_m: [f64; 2], rgb: [f64; 3]) -> Texture {
        Texture::Bricks {
            size_m,
            joint_m: 0.008,
            rgb,
            spread: 34.0,
            seed: self.seed(),
        }
    }

    /// Two plain walls, one of bricks, one with wallpaper, a plank floor, a plain ceiling.
    fn walls(&mut self) {
        let plain = |r: f64, g: f64, b: f64| Texture::Plain { rgb: [r, g, b] };
        let bricks = Texture::Bricks {
            size_m: [0.25, 0.09],
            joint_m: 0.014,
            rgb: [168.0, 106.0, 84.0],
            spread: 38.0,
            seed: self.seed(),
        };
        let wallpaper = Texture::Mosaic {
            size_m: 0.5,
            octaves: 3,
            softness: 0.35,
            rgb: [176.0, 182.0, 160.0],
            spread: [42.0, 40.0, 52.0],
            solid: false,
            seed: self.seed(),
        };
        let floor = self.wood([1.1, 0.14], [150.0, 112.0, 76.0]);
        let textures = vec![
            plain(214.0, 206.0, 190.0),
            wallpaper,
            plain(232.0, 232.0, 228.0),
            floor,
            plain(198.0, 208.0, 214.0),
            bricks,
        ];
        let room = Room {
            min: ROOM_MIN.into(),
            max: ROOM_MAX.into(),
        };
        self.primitives.push(Primitive {
            shape: room.into(),
            textures,
        });
    }

    /// Three beams and a lamp under the ceiling.
    fn ceiling(&mut self) {
        let (ceiling, length) = (ROOM_MIN[1], ROOM_MAX[2] - ROOM_MIN[2]);
        for x in [-2.0, 0.0, 2.0] {
            let wood = self.wood([0.9, 0.07], [126.0, 92.0, 62.0]);
            let place = [x + self.jitter(0.2), ceiling + 0.12, 0.0];
            self.block(place, [0.16, 0.12, length - 0.01], 0.0, wood);
        }
        let glass = self.marble(0.1, [226.0, 220.0, 200.0], 28.0);
        self.ball([1.0, ceiling + 0.34, 0.3], 0.17, glass);
    }

    /// A table in the middle with things on it, and two stools.
    fn table(&mut self) {
        let yaw = self.jitter(0.4);
        let top = self.wood([0.6, 0.1], [176.0, 128.0, 82.0]);
        self.block([0.0, FLOOR - 0.70, 0.0], [1.15, 0.05, 0.75], yaw, top);
        let leg = self.tiles(0.08, [96.0, 70.0, 50.0], 40.0);
        self.cylinder([0.0, FLOOR, 0.0], 0.09, 0.70, leg);
        let desk = FLOOR - 0.75;
        let box_paint = self.tiles(0.06, [150.0, 70.0, 60.0], 90.0);
        let box_yaw = self.jitter(1.5);
        self.block([-0.3, desk, 0.12], [0.26, 0.2, 0.18], box_yaw, box_paint);
        let globe = self.marble(0.07, [70.0, 120.0, 160.0], 100.0);
        self.ball([0.27, desk, -0.1], 0.13, globe);
        let can = Texture::Checker {
            size_m: 0.045,
            edge_m: 0.003,
            colours: [[225.0, 215.0, 190.0], [40.0, 60.0, 90.0]],
        };
        self.cylinder([0.05, desk, 0.2], 0.055, 0.22, can);
        for side in [-1.0, 1.0] {
            let cushion = self.tiles(0.12, [110.0, 120.0, 90.0], 80.0);
            let (x, z) = (side * (0.55 + self.jitter(0.05)), side * 0.5);
            self.cylinder([x, FLOOR, z], 0.19, 0.45, cushion);
        }
    }

    /// Along +z (bricks): a shelf with books, a chest, a picture.
    fn back_wall(&mut self) {
        let (z, x) = (ROOM_MAX[2], -1.3 + self.jitter(0.15));
        for level in 0..4 {
            let height = FLOOR - 0.45 * f64::from(level);
            let board = self.wood([0.8, 0.05], [120.0, 84.0, 56.0]);
            self.block([x, height, z - 0.2], [1.5, 0.04, 0.36], 0.0, board);
            if level < 3 {
                let books = self.tiles(0.085, [125.0, 100.0, 85.0], 110.0);
                let (shift, width) = (self.jitter(0.1), 1.0 + self.jitter(0.2));
                let tall = 0.28 + self.jitter(0.04);
                let place = [x + shift, height - 0.04, z - 0.15];
                self.block(place, [width, tall, 0.2], 0.0, books);
            }
        }
        let vase = self.marble(0.09, [180.0, 150.0, 60.0], 90.0);
        self.ball([x + 0.4, FLOOR - 1.39, z - 0.2], 0.16, vase);
        let chest = self.tiles(0.3, [128.0, 110.0, 92.0], 75.0);
        let turn = self.jitter(0.12);
        let shift = self.jitter(0.2);
        self.block([1.2 + shift, FLOOR, z - 0.38], [1.1, 0.8, 0.5], turn, chest);
        let middle = [1.2, -0.25 + self.jitter(0.1), z];
        self.poster(middle, -Vector3::z(), [1.2, 0.8], 0.16);
    }

    /// Along -z (plain): a sofa, a lamp, two pictures.
    fn front_wall(&mut self) {
        let (z, x) = (ROOM_MIN[2], 0.2 + self.jitter(0.2));
        let cloth = self.tiles(0.2, [100.0, 116.0, 132.0], 62.0);
        self.block([x, FLOOR, z + 0.42], [1.9, 0.42, 0.72], 0.0, cloth);
        self.block([x, FLOOR - 0.42, z + 0.16], [1.9, 0.42, 0.2], 0.0, cloth);
        for side in [-0.6, 0.1, 0.62] {
            let cushion = self.tiles(0.1, [170.0, 110.0, 70.0], 85.0);
            let turn = self.jitter(0.4);
            let place = [x + side, FLOOR - 0.42, z + 0.42];
            self.block(place, [0.42, 0.34, 0.14], turn, cushion);
        }
        let shade = self.tiles(0.12, [215.0, 195.0, 140.0], 40.0);
        let pole = self.tiles(0.05, [70.0, 70.0, 74.0], 45.0);
        self.cylinder([-1.75, FLOOR, z + 0.35], 0.035, 1.35, pole);
        self.cylinder([-1.75, FLOOR - 1.35, z + 0.35], 0.2, 0.34, shade);
        self.poster([x - 0.45, -0.45, z], Vector3::z(), [0.9, 0.7], 0.12);
        self.poster([x + 0.75, -0.4, z], Vector3::z(), [0.6, 0.85], 0.2);
        self.poster([-2.35, -0.3, z], Vector3::z(), [0.5, 0.7], 0.1);
    }

    /// Along -x (plain): a desk with boxes, a ball, a picture, a plant pot.
    fn left_wall(&mut self) {
        let (x, z) = (ROOM_MIN[0], self.jitter(0.2));
        let wood = self.wood([0.7, 0.08], [196.0, 160.0, 112.0]);
        self.block([x + 0.36, FLOOR - 0.68, z], [0.68, 0.05, 1.7], 0.0, wood);
        for side in [-0.78, 0.78] {
            self.block([x + 0.36, FLOOR, z + side], [0.6, 0.68, 0.06], 0.0, wood);
        }
        let screen = self.tiles(0.09, [90.0, 100.0, 120.0], 95.0);
        let turn = self.jitter(0.3);
        self.block(
            [x + 0.25, FLOOR - 0.73, z - 0.3],
            [0.06, 0.45, 0.7],
            turn,
            screen,
        );
        let carton = self.tiles(0.14, [172.0, 138.0, 96.0], 60.0);
        self.block(
            [x + 0.3, FLOOR - 0.73, z + 0.5],
            [0.36, 0.3, 0.4],
            0.35 + turn,
            carton,
        );
        let rubber = self.marble(0.16, [190.0, 80.0, 70.0], 90.0);
        let shift = self.jitter(0.1);
        self.ball([x + 0.42, FLOOR, -1.55 + shift], 0.3, rubber);
        let pot = self.tiles(0.1, [150.0, 90.0, 66.0], 60.0);
        let leaves = self.marble(0.14, [70.0, 120.0, 62.0], 75.0);
        self.cylinder([x + 0.45, FLOOR, 1.95], 0.22, 0.42, pot);
        self.ball([x + 0.45, FLOOR - 0.40, 1.95], 0.36, leaves);
        self.poster([x, -0.42, z + 0.15], Vector3::x(), [1.3, 0.85], 0.18);
    }

    /// Along +x (wallpaper): cupboards of two heights, a stack of boxes, a picture.
    fn right_wall(&mut self) {
        let x = ROOM_MAX[0];
        let doors = self.tiles(0.42, [158.0, 140.0, 116.0], 55.0);
        let shift = self.jitter(0.1);
        self.block(
            [x - 0.3, FLOOR, -1.5 + shift],
            [0.56, 1.95, 0.9],
            0.0,
            doors,
        );
        let drawers = self.wood([0.5, 0.2], [110.0, 124.0, 128.0]);
        let shift = self.jitter(0.15);
        self.block(
            [x - 0.28, FLOOR, 0.35 + shift],
            [0.5, 0.85, 1.3],
            0.0,
            drawers,
        );
        let lamp = self.marble(0.08, [210.0, 190.0, 150.0], 60.0);
        self.ball([x - 0.3, FLOOR - 0.85, 0.6], 0.15, lamp);
        let radio = self.tiles(0.07, [104.0, 88.0, 74.0], 90.0);
        let turn = self.jitter(0.5);
        self.block([x - 0.3, FLOOR - 0.85, 0.05], [0.2, 0.22, 0.4], turn, radio);
        let mut height = FLOOR;
        for size in [0.55, 0.44, 0.33] {
            let carton = self.tiles(0.15, [168.0, 132.0, 92.0], 70.0);
            let turn = self.jitter(0.35);
            self.block(
                [x - 0.42, height, 1.75],
                [size, 0.7 * size, size],
                turn,
                carton,
            );
            height -= 0.7 * size;
        }
        self.poster([x, -0.35, 0.4], -Vector3::x(), [1.4, 0.8], 0.15);
    }
}
