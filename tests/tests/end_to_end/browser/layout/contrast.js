// Colours are [red, green, blue, alpha], 0 to 1.
const known = new Map();
const colour = text => {
  if (!known.has(text)) {
    pen.clearRect(0, 0, 1, 1);
    pen.fillStyle = text;
    pen.fillRect(0, 0, 1, 1);
    known.set(text, [...pen.getImageData(0, 0, 1, 1).data].map(value => value / 255));
  }
  return known.get(text);
};
const over = (front, back) => {
  const alpha = front[3] + back[3] * (1 - front[3]);
  const mixed = k => alpha && (front[k] * front[3] + back[k] * back[3] * (1 - front[3])) / alpha;
  return [mixed(0), mixed(1), mixed(2), alpha];
};

// As WCAG 2 defines them.
const luminance = rgb => {
  const linear = rgb.map(value => value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);
  return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
};
const ratio = (a, b) => {
  const [dark, bright] = [luminance(a), luminance(b)].sort((x, y) => x - y);
  return (bright + 0.05) / (dark + 0.05);
};

// What lies below everything depends on the theme.
const sheet = document.createElement('span');
sheet.style.backgroundColor = 'Canvas';
document.documentElement.append(sheet);
const canvas = colour(getComputedStyle(sheet).backgroundColor);
sheet.remove();

// Every colour that an element's background may have at some place: its own, and those of a gradient on it.
const backgrounds = style => {
  const own = colour(style.backgroundColor);
  const stops = style.backgroundImage.match(/(rgba?|color|oklab|oklch|lab|lch)\([^()]*\)/g) ?? [];
  return stops.length ? stops.map(stop => over(colour(stop), own)) : [own];
};
// The worst pair of a text and what is behind it, both as seen through everything up to the page's own ground.
const worst = (element, text, ground) => {
  if (!element) return { text: over(text, canvas), ground: over(ground, canvas) };
  const style = getComputedStyle(element);
  const fade = ([r, g, b, alpha]) => [r, g, b, alpha * style.opacity];
  const pairs = backgrounds(style).map(behind =>
    worst(element.parentElement, fade(over(text, behind)), fade(over(ground, behind))));
  return pairs.reduce((a, b) => ratio(b.text, b.ground) < ratio(a.text, a.ground) ? b : a);
};
const in_words = rgb => `rgb(${rgb.slice(0, 3).map(value => Math.round(255 * value)).join(', ')})`;

const found = [];
for (const { text, element, boxes } of texts()) {
  if (element.ownerSVGElement || boxes.length === 0) continue;
  const style = getComputedStyle(element);
  const size_px = parseFloat(style.fontSize);
  const needed = size_px >= 24 || (size_px >= 18.66 && style.fontWeight >= 700) ? 3 : 4.5;
  const pair = worst(element, colour(style.color), [0, 0, 0, 0]);
  const reached = ratio(pair.text, pair.ground);
  if (reached < needed) {
    const colours = `${in_words(pair.text)} on ${in_words(pair.ground)}`;
    found.push(`"${text}" in ${element.localName}: ${reached.toFixed(2)} of ${needed}, ${colours}`);
  }
}
return found;
