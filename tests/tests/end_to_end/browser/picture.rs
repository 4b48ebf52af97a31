//! Pictures of pages.

use png::{ColorType, Decoder, Transformations};

/// The width, the height and the colours of a PNG picture, row by row from the top. Transparency is left away.
pub(crate) fn pixels(png: &[u8]) -> (usize, usize, Vec<[u8; 3]>) {
    let mut decoder = Decoder::new(std::io::Cursor::new(png));
    decoder.set_transformations(Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut bytes).unwrap();
    let grey = matches!(frame.color_type, ColorType::Grayscale | ColorType::GrayscaleAlpha);
    let colour = |sample: &[u8]| if grey { [sample[0]; 3] } else { [sample[0], sample[1], sample[2]] };
    let rgb = bytes[..frame.buffer_size()].chunks_exact(frame.color_type.samples()).map(colour).collect();
    (frame.width as usize, frame.height as usize, rgb)
}
