//! Propagation of light from cell to cell (`glsl/gi/lpv/propagate.comp`), face by face as in the source's listing, in
//! f64.

use std::f64::consts::PI;

use glam::{DVec3, IVec3};

/// Travelling along +x +y +z −x −y −z.
pub const WAYS: [IVec3; 6] = [IVec3::X, IVec3::Y, IVec3::Z, IVec3::NEG_X, IVec3::NEG_Y, IVec3::NEG_Z];

/// Light in a cell. A lobe sends the intensity (flux + moment · ω) / 4π towards unit ω.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell {
    pub flux: f64,
    pub moment: DVec3,
}

/// The model of travelling light.
#[derive(Clone, Copy, PartialEq)]
pub enum Rules {
    /// In lobes of 1 + 2 cos θ, clamped where they are negative. `own`: a step starts from the cell's own light.
    /// `integral`: that of the lobe that a face emits for the intensity that meets it, times Ω/4π.
    Lobes { own: bool, integral: f64 },
    /// In beams with the moment as flux × mean direction, whose mean cosine is at most this (`glsl/gi/lpv/beams.glsl`).
    Beams(f64),
}

/// A cube of cells, x fastest.
#[derive(Clone)]
pub struct Cells {
    pub edge: i32,
    pub cells: Vec<Cell>,
    /// The share that passes into each cell, by [`WAYS`].
    pub passages: Vec<[f64; 6]>,
}

impl Cells {
    pub fn empty(edge: i32) -> Self {
        let count = edge.pow(3) as usize;
        Self { edge, cells: vec![Cell::default(); count], passages: vec![[1.0; 6]; count] }
    }

    pub fn index(&self, cell: IVec3) -> Option<usize> {
        let inside = cell.cmpge(IVec3::ZERO).all() && cell.cmplt(IVec3::splat(self.edge)).all();
        inside.then(|| ((cell.z * self.edge + cell.y) * self.edge + cell.x) as usize)
    }

    pub fn at(&self, cell: IVec3) -> Cell {
        self.index(cell).map_or(Cell::default(), |index| self.cells[index])
    }

    pub fn put(&mut self, cell: IVec3, light: Cell) {
        let index = self.index(cell).expect("a cell inside");
        self.cells[index] = light;
    }

    pub fn total(&self) -> f64 {
        self.cells.iter().map(|cell| cell.flux).sum()
    }

    pub fn step(&self, rules: Rules) -> Self {
        let mut next = self.clone();
        for index in 0..self.cells.len() as i32 {
            let cell = IVec3::new(index % self.edge, index / self.edge % self.edge, index / self.edge.pow(2));
            let own = matches!(rules, Rules::Lobes { own: true, .. });
            let mut sum = if own { self.cells[index as usize] } else { Cell::default() };
            for (k, way) in WAYS.into_iter().enumerate() {
                let from = self.at(cell - way);
                for face in WAYS.into_iter().filter(|face| *face != -way) {
                    let sent = flux_onto(rules, from, way, face) * self.passages[index as usize][k];
                    sum.flux += sent;
                    sum.moment += sent
                        * match rules {
                            Rules::Lobes { .. } => 2.0 * face.as_dvec3(),
                            Rules::Beams(_) => direction(way, face),
                        };
                }
            }
            next.cells[index as usize] = sum;
        }
        next
    }
}

/// From a cell's centre to a face of the next one along `way`.
fn direction(way: IVec3, face: IVec3) -> DVec3 {
    (way.as_dvec3() + 0.5 * face.as_dvec3()).normalize()
}

fn solid_angle(way: IVec3, face: IVec3) -> f64 {
    if face == way { 22.95668 / 720.0 } else { 24.26083 / 720.0 }
}

/// From a cell onto a face of the next one along `way`.
fn flux_onto(rules: Rules, from: Cell, way: IVec3, face: IVec3) -> f64 {
    match rules {
        Rules::Lobes { integral, .. } => {
            integral / (4.0 * PI)
                * solid_angle(way, face)
                * (from.flux + from.moment.dot(direction(way, face))).max(0.0)
        }
        Rules::Beams(sharpness) => from.flux * share(from.mean_direction(sharpness), way, face),
    }
}

impl Cell {
    fn mean_direction(&self, sharpness: f64) -> DVec3 {
        if self.flux > 0.0 { (self.moment / self.flux).clamp_length_max(sharpness) } else { DVec3::ZERO }
    }
}

/// The share of a beam's light that meets a face: Henyey and Greenstein's distribution at all of the thirty directions.
fn share(g: DVec3, way: IVec3, face: IVec3) -> f64 {
    part(g, way, face) / whole(g)
}

fn part(g: DVec3, way: IVec3, face: IVec3) -> f64 {
    solid_angle(way, face) * (1.0 + g.dot(g) - 2.0 * g.dot(direction(way, face))).powf(-1.5)
}

fn whole(g: DVec3) -> f64 {
    let faces = |way: IVec3| WAYS.into_iter().filter(move |face| *face != -way).map(move |face| part(g, way, face));
    WAYS.into_iter().flat_map(faces).sum()
}

/// Mean direction of a beam, and the total by which its shares are divided.
pub fn aim(cell: Cell, sharpness: f64) -> (DVec3, f64) {
    let g = cell.mean_direction(sharpness);
    (g, whole(g))
}

/// For each direction the share that goes to that neighbour, and share × direction.
pub fn shares(cell: Cell, sharpness: f64) -> [(f64, DVec3); 6] {
    let g = cell.mean_direction(sharpness);
    WAYS.map(|way| {
        let faces = WAYS.into_iter().filter(|face| *face != -way);
        let each = faces.map(|face| (share(g, way, face), direction(way, face)));
        each.fold((0.0, DVec3::ZERO), |sum, (share, d)| (sum.0 + share, sum.1 + share * d))
    })
}

/// Four coefficients of two bands, in the listing's order: constant, −y, z, −x.
pub type Coefficients = [f64; 4];

/// The clamped cosine about a unit direction, with the integral π: the coefficients that the source's author published
/// per face.
pub const PUBLISHED: [f64; 2] = [0.886_226_952_1, 1.023_326_754_6];

/// A lobe with these coefficients of the two bands.
pub fn coefficients([constant, along]: [f64; 2], d: DVec3) -> Coefficients {
    [constant, -along * d.y, along * d.z, -along * d.x]
}

fn dot(a: Coefficients, b: Coefficients) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// One colour's light in a cube of cells, x fastest, in the terms of the source's page.
#[derive(Clone)]
pub struct Texture {
    pub edge: i32,
    pub cells: Vec<Coefficients>,
}

impl Texture {
    fn index(&self, cell: IVec3) -> usize {
        ((cell.z * self.edge + cell.y) * self.edge + cell.x) as usize
    }

    /// A step of listing 7.3, line by line, without occlusion: `face` are the coefficients along each face's direction,
    /// and the sums start from the cell's own light.
    pub fn step(&self, face: [f64; 2]) -> Self {
        let basis = [0.5 / PI.sqrt(), (0.75 / PI).sqrt()];
        let mut sums = self.clone();
        for index in 0..self.cells.len() as i32 {
            let cell = IVec3::new(index % self.edge, index / self.edge % self.edge, index / self.edge.pow(2));
            for to_neighbour in WAYS {
                let neighbour = cell + to_neighbour;
                if neighbour.min_element() < 0 || neighbour.max_element() >= self.edge {
                    continue;
                }
                let light = self.cells[self.index(neighbour)];
                for face_direction in WAYS.map(|way| way.as_dvec3()) {
                    let way = 0.5 * face_direction - to_neighbour.as_dvec3();
                    let solid_angle = match way.length() {
                        length if length >= 1.5 => 22.95668 / (4.0 * 180.0),
                        length if length > 0.5 => 24.26083 / (4.0 * 180.0),
                        _ => 0.0,
                    };
                    let flux = dot(light, coefficients(basis, way.normalize())).max(0.0) * solid_angle;
                    let sum = &mut sums.cells[index as usize];
                    sum.iter_mut().zip(coefficients(face, face_direction)).for_each(|(sum, c)| *sum += c * flux);
                }
            }
        }
        sums
    }

    /// Irradiance at a place, in cells, of a surface with that normal: the light of the eight cells around it that
    /// travels towards the surface, against the clamped cosine.
    pub fn irradiance(&self, at: DVec3, normal: DVec3) -> f64 {
        let corner = (at - 0.5).floor();
        let part = at - 0.5 - corner;
        let mut light = [0.0; 4];
        for k in 0..8 {
            let step = IVec3::new(k & 1, k >> 1 & 1, k >> 2);
            let weight: f64 = (0..3).map(|i| if step[i] == 0 { 1.0 - part[i] } else { part[i] }).product();
            let cell = (corner.as_ivec3() + step).clamp(IVec3::ZERO, IVec3::splat(self.edge - 1));
            light.iter_mut().zip(self.cells[self.index(cell)]).for_each(|(sum, c)| *sum += weight * c);
        }
        dot(light, coefficients(PUBLISHED, -normal)).max(0.0)
    }
}

/// The device's flux and moment of a cell as coefficients: both send the same intensity.
pub fn as_coefficients(flux: f64, moment: DVec3) -> Coefficients {
    coefficients([0.5 * flux / PI.sqrt(), 1.0 / (12.0 * PI).sqrt()], moment)
}
