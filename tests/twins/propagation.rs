//! Light that travels from cell to cell (`glsl/gi/lpv/propagate.comp`), face by face as the source's listing has it, in f64.

use glam::{DVec3, IVec3};

/// Travelling along +x +y +z −x −y −z.
pub const WAYS: [IVec3; 6] = [IVec3::X, IVec3::Y, IVec3::Z, IVec3::NEG_X, IVec3::NEG_Y, IVec3::NEG_Z];

/// Towards unit ω a cell sends the intensity (flux + moment · ω) / 4π.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell {
    pub flux: f64,
    pub moment: DVec3,
}

/// How light travels.
#[derive(Clone, Copy)]
pub struct Rules {
    /// Lobes of 1 + cos θ; else of 1 + 2 cos θ, cut off where they are negative.
    pub even: bool,
    /// A step starts from the cell's own light.
    pub own: bool,
}

/// A cube of cells, x fastest.
#[derive(Clone)]
pub struct Cells {
    pub edge: i32,
    pub cells: Vec<Cell>,
    /// Per cell the share that passes into it, by [`WAYS`].
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
            let mut sum = if rules.own { self.cells[index as usize] } else { Cell::default() };
            for (k, way) in WAYS.iter().enumerate() {
                let from = self.at(cell - *way);
                for face in WAYS.into_iter().filter(|face| *face != -*way) {
                    let sent = flux_onto(from, *way, face) * self.passages[index as usize][k];
                    sum.flux += sent;
                    sum.moment += face.as_dvec3() * sent * if rules.even { 1.0 } else { 2.0 };
                }
            }
            next.cells[index as usize] = sum;
        }
        next
    }
}

/// From a cell onto a face of the next one along `way`.
fn flux_onto(from: Cell, way: IVec3, face: IVec3) -> f64 {
    let to = way.as_dvec3() + 0.5 * face.as_dvec3(); // from the cell's centre to the face's
    let share = if face == way { 22.95668 } else { 24.26083 } / 720.0;
    share * (from.flux + from.moment.dot(to.normalize())).max(0.0)
}
