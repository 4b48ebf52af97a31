//! Small pictures of at most sixteen colours.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::colour::Rgb;

/// Pixels that are numbers of colours; 0 is nothing, through which the page is seen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Image {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pixels: Vec<u8>,
}

impl Image {
    /// A picture of nothing.
    pub(crate) fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![0; width * height] }
    }

    fn pixel(&mut self, column: i32, row: i32) -> Option<&mut u8> {
        let at = usize::try_from(column).ok().zip(usize::try_from(row).ok());
        let (column, row) = at.filter(|(column, row)| *column < self.width && *row < self.height)?;
        self.pixels.get_mut(row * self.width + column)
    }

    /// Colours a pixel; column and row count from the left and the top. What is outside is left out.
    pub(crate) fn set(&mut self, column: i32, row: i32, colour: u8) {
        if let Some(pixel) = self.pixel(column, row) {
            *pixel = colour;
        }
    }

    /// Colours a pixel unless it has a colour of a higher number: the same in whatever order things are drawn.
    pub(crate) fn raise(&mut self, column: i32, row: i32, colour: u8) {
        if let Some(pixel) = self.pixel(column, row) {
            *pixel = colour.max(*pixel);
        }
    }

    /// Raises the pixels on a line.
    pub(crate) fn line(&mut self, from: [f64; 2], to: [f64; 2], colour: u8) {
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        // A line across the picture has no more pixels than this; a longer one lies outside for the most part.
        let steps = dx.abs().max(dy.abs()).ceil().min(4.0 * (self.width + self.height) as f64);
        if !steps.is_finite() {
            return;
        }
        for step in 0..=steps as i32 {
            let part = f64::from(step) / steps.max(1.0);
            self.raise((from[0] + part * dx).floor() as i32, (from[1] + part * dy).floor() as i32, colour);
        }
    }

    #[cfg(test)]
    pub(crate) fn get(&self, column: usize, row: usize) -> u8 {
        self.pixels[row * self.width + column]
    }

    /// The picture as a PNG in a `data:` address; `colours` are those of the numbers from 1 on, at most fifteen.
    pub(crate) fn to_data_url(&self, colours: &[Rgb]) -> Result<String, png::EncodingError> {
        Ok(format!("data:image/png;base64,{}", STANDARD.encode(self.to_png(colours)?)))
    }

    fn to_png(&self, colours: &[Rgb]) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Four);
        let palette: Vec<u8> = std::iter::once(&[0; 3]).chain(colours).take(16).flatten().copied().collect();
        encoder.set_palette(palette);
        encoder.set_trns(vec![0]);
        encoder.set_compression(png::Compression::Fast);
        encoder.set_filter(png::Filter::NoFilter);
        let mut writer = encoder.write_header()?;
        // Two pixels a byte, every row beginning with one of its own.
        let packed: Vec<u8> = self
            .pixels
            .chunks(self.width.max(1))
            .flat_map(|row| row.chunks(2).map(|pair| (pair[0] << 4) | pair.get(1).copied().unwrap_or(0)))
            .collect();
        writer.write_image_data(&packed)?;
        writer.finish()?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_read_back_as_it_was() {
        let mut image = Image::new(5, 3);
        image.line([0.5, 0.5], [4.5, 2.5], 2);
        image.set(4, 0, 15);
        [(-1, 0), (5, 0), (0, 3), (i32::MAX, i32::MIN)].into_iter().for_each(|(x, y)| image.set(x, y, 1));
        image.line([f64::NAN, 0.0], [1.0, 1.0], 1);
        image.line([-1e18, 0.0], [-1e17, 1e18], 1);
        let colours: Vec<Rgb> = (1..16).map(|k| [k, 2 * k, 3 * k]).collect();
        let bytes = image.to_png(&colours).unwrap();
        let mut decoder = png::Decoder::new(std::io::Cursor::new(&bytes));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().unwrap();
        let mut rgba = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut rgba).unwrap();
        for (k, pixel) in rgba.as_chunks::<4>().0.iter().enumerate() {
            let number = image.get(k % 5, k / 5);
            let expected = if number == 0 { [0; 4] } else { [number, 2 * number, 3 * number, 255] };
            assert_eq!(*pixel, expected, "{k}");
        }
        assert_eq!((image.get(0, 0), image.get(2, 1), image.get(4, 2), image.get(4, 0)), (2, 2, 2, 15));
        assert!(image.to_data_url(&colours).unwrap().starts_with("data:image/png;base64,iVBORw0KGgo"));
    }
}
