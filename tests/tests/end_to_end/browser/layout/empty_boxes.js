const found = [];
const drawn = 'path, rect, circle, line, polyline, polygon, text, image, use, ellipse';
const media = 'img, svg, canvas, video, object, iframe, input, meter, progress';
const within = (element, selector) => [...element.querySelectorAll(selector)].filter(visible);
const all = texts();
// Whether there is text or a picture outside of what only names the rest.
const has_content = (element, names) => within(element, media).length > 0
  || all.some(text => element.contains(text.element) && !text.element.closest(names));

for (const element of within(document.body, 'section, figure, table, svg, img')) {
  const { width, height } = element.getBoundingClientRect();
  if (element.ownerSVGElement) continue;
  if (width === 0 || height === 0) found.push(`${named(element)} is ${width} × ${height} px`);
  const kind = element.localName;
  if (kind === 'section' && !has_content(element, 'h1, h2, h3, h4, h5, h6')) {
    found.push(`${named(element)} has nothing but a heading`);
  } else if (kind === 'figure' && !has_content(element, 'figcaption')
    && within(element, 'table').length === 0) {
    found.push(`${named(element)} has nothing but a caption`);
  } else if (kind === 'table' && within(element, 'td').length === 0) {
    found.push(`${named(element)} has no cell of data`);
  } else if (kind === 'svg' && within(element, drawn).length === 0) {
    found.push(`${named(element)} has nothing drawn`);
  }
}
for (const row of within(document.body, 'tr')) {
  if (within(row, 'td, th').length === 0) found.push(`${named(row)} in ${named(row.closest('table'))} has no cell`);
}
// Only a picture that is whole can be decoded; a broken one may still have a size.
const pictures = within(document.body, 'img, image');
const broken = picture => picture.decode().then(() => null, () => picture);
return Promise.all(pictures.map(broken)).then(results => {
  for (const picture of results.filter(Boolean)) {
    const source = picture.getAttribute('src') ?? picture.getAttribute('href') ?? '';
    found.push(`${named(picture)} of ${short(source)} is not drawn`);
  }
  return found;
});
