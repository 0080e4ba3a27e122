//! The U.S. Standard Atmosphere 1976 (NOAA, NASA, USAF), sections 1.2 and 1.3: pressure and density to 84.852 km.

/// Standard acceleration of gravity, m/s^2.
const GRAVITY: f64 = 9.806_65;
/// Gas constant of the model, J/(kmol K).
const GAS_CONSTANT: f64 = 8314.32;
/// Molar mass of air at sea level, kg/kmol.
const MOLAR_MASS: f64 = 28.9644;
/// g M / R, the hydrostatic constant: K/m.
const HYDROSTATIC: f64 = GRAVITY * MOLAR_MASS / GAS_CONSTANT;
/// Temperature at sea level, K.
const SEA_LEVEL_TEMPERATURE: f64 = 288.15;
/// R T0 / (M g), the scale height, in metres: height of an atmosphere with the sea-level density throughout.
pub const SCALE_HEIGHT: f64 = SEA_LEVEL_TEMPERATURE / HYDROSTATIC;

/// Base height (m) and temperature gradient (K/m) of each layer; the air ends at the last base.
const LAYERS: [(f64, f64); 8] = [
    (0.0, -0.0065),
    (11_000.0, 0.0),
    (20_000.0, 0.001),
    (32_000.0, 0.0028),
    (47_000.0, 0.0),
    (51_000.0, -0.0028),
    (71_000.0, -0.002),
    (84_852.0, 0.0),
];

/// State of the air at a height, relative to sea level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// p / p0
    pub pressure: f64,
    /// rho / rho0
    pub density: f64,
    /// d(rho / rho0) / d(height), per metre.
    pub gradient: f64,
}

impl Air {
    /// Vacuum.
    pub const NONE: Self = Self { pressure: 0.0, density: 0.0, gradient: 0.0 };

    /// Returns the state of the air at a height in metres; the lowest layer continues below sea level.
    ///
    /// From dp/dz = -rho g and rho = p M / (R T): in a layer of gradient L, p is proportional to T^(-g M / (R L)), or exponential if L = 0.
    /// Heights are treated as geopotential heights.
    pub fn at(height: f64) -> Self {
        let (mut temperature, mut pressure) = (SEA_LEVEL_TEMPERATURE, 1.0);
        for pair in LAYERS.windows(2) {
            let ((base, lapse), (top, _)) = (pair[0], pair[1]);
            let thickness = height.min(top) - base;
            let above = temperature + lapse * thickness;
            pressure *= if lapse == 0.0 {
                (-HYDROSTATIC * thickness / temperature).exp()
            } else {
                (temperature / above).powf(HYDROSTATIC / lapse)
            };
            temperature = above;
            if height < top {
                let density = pressure * SEA_LEVEL_TEMPERATURE / temperature;
                return Self { pressure, density, gradient: -density * (HYDROSTATIC + lapse) / temperature };
            }
        }
        Self::NONE
    }
}
