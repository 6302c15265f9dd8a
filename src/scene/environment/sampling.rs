//! Directions chosen in proportion to an environment's luminance, with their exact density.
//!
//! The map is cut into cells (texels, or square blocks of them in a large map). A cell is drawn from an alias table by
//! the luminance it holds, and a direction uniformly by solid angle inside it: the density is therefore one constant
//! per cell, exact for any direction. A cell's luminance is that of the *bilinear* map, neighbours included, so no
//! direction that sends light has density zero.

use std::f32::consts::{FRAC_1_PI, TAU};
use std::f64::consts::PI;

use glam::{Vec2, Vec3};

use super::super::alias::alias_table;
use super::{Environment, EnvironmentMap};

/// Larger maps are sampled by blocks of texels, so that tables stay within 24 MiB.
pub const MAX_CELL_COUNT: u64 = 1 << 21;

/// Alias table over the cells, row by row. For a constant environment it has a single cell.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentSampler {
    pub cells: Vec<Cell>,
    pub cell_columns: u32,
    pub cell_rows: u32,
    /// Texels a side of a cell; those at the right and lower border may be smaller.
    pub cell_extent: u32,
    /// Texels of the map; 1 x 1 for a constant environment.
    pub width: u32,
    pub height: u32,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Draw this cell when the second random number is below, else `alias`. In 0..1.
    pub threshold: f32,
    pub alias: u32,
    /// Density of directions in this cell, sr^-1.
    pub density: f32,
}

/// A direction and its density in solid angle, sr^-1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledDirection {
    /// Unit.
    pub direction: Vec3,
    pub density: f32,
}

impl EnvironmentSampler {
    pub fn new(environment: &Environment) -> Self {
        let Environment::Map(map) = environment else {
            let cells = vec![Cell { threshold: 1.0, alias: 0, density: FRAC_1_PI / 4.0 }];
            return Self { cells, cell_columns: 1, cell_rows: 1, cell_extent: 1, width: 1, height: 1 };
        };
        let mut extent = 1;
        while cells_along(map.width, extent) * cells_along(map.height, extent) > MAX_CELL_COUNT {
            extent *= 2;
        }
        let (columns, rows) = (cells_along(map.width, extent) as u32, cells_along(map.height, extent) as u32);
        let mut sampler = Self {
            cells: Vec::new(),
            cell_columns: columns,
            cell_rows: rows,
            cell_extent: extent,
            width: map.width,
            height: map.height,
        };

        let solid_angles: Vec<f64> =
            (0..rows * columns).map(|cell| sampler.solid_angle(cell % columns, cell / columns)).collect();
        let mut powers = sampler.powers(map);
        if powers.iter().sum::<f64>() <= 0.0 {
            powers.clone_from(&solid_angles);
        }
        let total: f64 = powers.iter().sum();
        let probabilities: Vec<f64> = powers.iter().map(|power| power / total).collect();
        let aliases = alias_table(&probabilities);
        sampler.cells = (aliases.into_iter().zip(probabilities.iter().zip(&solid_angles)))
            .map(|((threshold, alias), (probability, solid_angle))| Cell {
                threshold,
                alias,
                density: (probability / solid_angle) as f32,
            })
            .collect();
        sampler
    }

    /// Density of [`Self::sample`] at a unit direction, sr^-1.
    pub fn density(&self, environment: &Environment, direction: Vec3) -> f32 {
        let Environment::Map(map) = environment else { return self.cells[0].density };
        let uv = map.uv_of(direction);
        let column = ((uv.x * self.width as f32) as u32).min(self.width - 1) / self.cell_extent;
        let row = ((uv.y * self.height as f32) as u32).min(self.height - 1) / self.cell_extent;
        self.cells[(row * self.cell_columns + column) as usize].density
    }

    /// A direction from four random numbers in 0..1: `choose` draws the cell, `inside` the place in it.
    pub fn sample(&self, environment: &Environment, choose: Vec2, inside: Vec2) -> SampledDirection {
        let drawn = ((choose.x * self.cells.len() as f32) as usize).min(self.cells.len() - 1);
        let cell = &self.cells[drawn];
        let index = if choose.y < cell.threshold { drawn as u32 } else { cell.alias };
        let density = self.cells[index as usize].density;
        let (columns, rows) = self.span(index % self.cell_columns, index / self.cell_columns);
        let u = lerp(columns[0] as f32, columns[1] as f32, inside.x) / self.width as f32;
        let cosines = rows.map(|row| (PI * f64::from(row) / f64::from(self.height)).cos() as f32);
        let cos_theta = lerp(cosines[0], cosines[1], inside.y);
        let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        let direction = match environment {
            Environment::Map(map) => map.direction_at(u, cos_theta, sin_theta),
            Environment::Constant(_) => {
                let (sin_phi, cos_phi) = (u * TAU).sin_cos();
                Vec3::new(sin_theta * cos_phi, cos_theta, sin_theta * sin_phi)
            }
        };
        SampledDirection { direction, density }
    }

    /// First and past-the-last texel column and row of a cell.
    fn span(&self, column: u32, row: u32) -> ([u32; 2], [u32; 2]) {
        let along = |cell: u32, size: u32| {
            let first = cell * self.cell_extent;
            [first, (first + self.cell_extent).min(size)]
        };
        (along(column, self.width), along(row, self.height))
    }

    /// Steradians a cell covers.
    fn solid_angle(&self, column: u32, row: u32) -> f64 {
        let (columns, rows) = self.span(column, row);
        let phi = 2.0 * PI * f64::from(columns[1] - columns[0]) / f64::from(self.width);
        let [upper, lower] = rows.map(|row| (PI * f64::from(row) / f64::from(self.height)).cos());
        phi * (upper - lower)
    }

    /// Luminance times solid angle per cell.
    fn powers(&self, map: &EnvironmentMap) -> Vec<f64> {
        let mut powers = vec![0.0; (self.cell_columns * self.cell_rows) as usize];
        let height = f64::from(map.height);
        for y in 0..map.height {
            let [upper, lower] = [y, y + 1].map(|row| (PI * f64::from(row) / height).cos());
            let texel_solid_angle = 2.0 * PI / f64::from(map.width) * (upper - lower);
            for x in 0..map.width {
                let cell = y / self.cell_extent * self.cell_columns + x / self.cell_extent;
                powers[cell as usize] += bilinear_luminance(map, x, y) * texel_solid_angle;
            }
        }
        powers
    }
}

fn cells_along(texels: u32, extent: u32) -> u64 {
    u64::from(texels.div_ceil(extent))
}

fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Mean luminance of the bilinear map over one texel: the integral of its tent gives weights 1/8, 6/8, 1/8 a side.
fn bilinear_luminance(map: &EnvironmentMap, x: u32, y: u32) -> f64 {
    const WEIGHTS: [f64; 3] = [0.125, 0.75, 0.125];
    let mut sum = 0.0;
    for (row, row_weight) in (-1..=1).zip(WEIGHTS) {
        for (column, column_weight) in (-1..=1).zip(WEIGHTS) {
            let texel = map.texel(i64::from(x) + column, i64::from(y) + row);
            sum += row_weight * column_weight * luminance(texel);
        }
    }
    sum
}

/// Rec. 709 luminance.
pub(super) fn luminance(radiance: Vec3) -> f64 {
    let [r, g, b] = radiance.to_array().map(f64::from);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}
