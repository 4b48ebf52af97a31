// What the checks share. Rectangles are in px of the window, which is never scrolled.

const short = text => {
  const trimmed = text.trim().replace(/\s+/g, ' ');
  return trimmed.length > 40 ? trimmed.slice(0, 39) + '…' : trimmed;
};

// An element as it would be looked for: tag, id, classes and the beginning of its text.
const named = element => {
  const classes = [...element.classList].map(name => '.' + name).join('');
  const text = short(element.getAttribute('aria-label') || element.getAttribute('alt') || element.textContent);
  return element.localName + (element.id && '#' + element.id) + classes + (text && ` "${text}"`);
};

const visible = element => element.checkVisibility({ visibilityProperty: true, opacityProperty: true });

const ancestors = function* (element) {
  for (let above = element.parentElement; above; above = above.parentElement) yield above;
};

// The page itself scrolls by other rules.
const is_page = element => element === document.documentElement || element === document.body;
const overflow = element => is_page(element) ? 'visible' : getComputedStyle(element).overflowX;
const scrolls = element => ['auto', 'scroll'].includes(overflow(element));
const cuts = element => ['hidden', 'clip'].includes(overflow(element));

const common_part = (a, b) => ({
  left: Math.max(a.left, b.left),
  top: Math.max(a.top, b.top),
  right: Math.min(a.right, b.right),
  bottom: Math.min(a.bottom, b.bottom),
});
const is_empty = box => !(box.right > box.left && box.bottom > box.top);

// What an element shows of a box in it, when it and all around have cut it.
const shown = (box, element, by = cuts) => {
  for (const above of [element, ...ancestors(element)]) {
    if (by(above)) box = { ...box, ...common_part(box, above.getBoundingClientRect()) };
  }
  return box;
};
// Text that is there for a screen reader alone lies in a box of a pixel. What a picture cuts off is lost.
const is_unseen = (box, element) => {
  const is_html = above => above instanceof HTMLElement;
  const { left, top, right, bottom } = shown(box, element, above => is_html(above) && cuts(above));
  return right - left <= 1 || bottom - top <= 1;
};

// The height of a line of text, and how much of it lies above the capitals, where there is no ink to speak of.
const pen = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
const lines = new Map();
const line_of = element => {
  const { fontStyle, fontWeight, fontSize, fontFamily } = getComputedStyle(element);
  const font = `${fontStyle} ${fontWeight} ${fontSize} ${fontFamily}`;
  if (!lines.has(font)) {
    pen.font = font;
    const line = pen.measureText('H');
    const height = line.fontBoundingBoxAscent + line.fontBoundingBoxDescent;
    lines.set(font, { height, above: line.fontBoundingBoxAscent - line.actualBoundingBoxAscent });
  }
  return lines.get(font);
};

// The corners of a line of text that is turned, given the box around it: the height is known, the length follows.
const turned_corners = (box, element, { a, b }) => {
  const [width, height] = [box.right - box.left, box.bottom - box.top];
  const scale = Math.hypot(a, b), [cos, sin] = [a / scale, b / scale];
  const line = line_of(element), half = scale * line.height / 2;
  const length = Math.abs(cos) > Math.abs(sin)
    ? (width - 2 * half * Math.abs(sin)) / Math.abs(cos)
    : (height - 2 * half * Math.abs(cos)) / Math.abs(sin);
  const middle = [(box.left + box.right) / 2, (box.top + box.bottom) / 2];
  const at = (along, down) => [middle[0] + along * cos - down * sin, middle[1] + along * sin + down * cos];
  return [-length / 2, length / 2].flatMap(along => [at(along, scale * line.above - half), at(along, half)]);
};

// Every visible text with a box for each line of it; a line that is turned, as in SVG, has an angle and corners.
const texts = () => {
  const found = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode, element = node.parentElement;
    if (!node.data.trim() || !visible(element)) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const matrix = element.getScreenCTM?.();
    const turned = matrix && Math.abs(matrix.b) > 1e-3 * Math.abs(matrix.a);
    const boxes = [...range.getClientRects()].map(({ left, top, right, bottom }) => {
      const box = { left, top, right, bottom };
      const line = line_of(element);
      if (!turned) return { ...box, top: top + (bottom - top) * line.above / line.height };
      return { ...box, angle: Math.atan2(matrix.b, matrix.a), corners: turned_corners(box, element, matrix) };
    });
    found.push({ text: short(node.data), element, boxes: boxes.filter(box => !is_unseen(box, element)) });
  }
  return found;
};
