// What scrolls on its own shows only a part beside what does not scroll with it.
const beside = (box, element, other) => {
  for (const above of [element, ...ancestors(element)]) {
    if (above.contains(other)) break;
    if (scrolls(above)) box = { ...box, ...common_part(box, above.getBoundingClientRect()) };
  }
  return box;
};
// By how much two boxes cover each other as seen from an angle.
const common_size = (a, b, angle) => {
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const corners = box => box.corners
    ?? [[box.left, box.top], [box.right, box.top], [box.left, box.bottom], [box.right, box.bottom]];
  const span = (box, x, y) => {
    const along = corners(box).map(corner => corner[0] * x + corner[1] * y);
    return [Math.min(...along), Math.max(...along)];
  };
  const common = (x, y) => {
    const [[a_from, a_to], [b_from, b_to]] = [span(a, x, y), span(b, x, y)];
    return Math.min(a_to, b_to) - Math.max(a_from, b_from);
  };
  return [common(cos, sin), common(-sin, cos)];
};
const all = texts().flatMap(({ text, element, boxes }, number) =>
  boxes.map(box => ({ text, element, number, box: shown(box, element) })).filter(({ box }) => !is_empty(box)));
all.sort((a, b) => a.box.top - b.box.top);
const found = new Map();
for (let k = 0; k < all.length; ++k) {
  const a = all[k];
  for (let other = k + 1; other < all.length && all[other].box.top < a.box.bottom - 2; ++other) {
    const b = all[other];
    const pair = a.number < b.number ? [a, b] : [b, a];
    const key = pair.map(({ number }) => number).join();
    if (a.number === b.number || found.has(key) || is_empty(common_part(a.box, b.box))) continue;
    const [a_box, b_box] = [beside(a.box, a.element, b.element), beside(b.box, b.element, a.element)];
    if (is_empty(a_box) || is_empty(b_box)) continue;
    // Boxes are apart if they are so as seen along a side of either.
    const [as_a, as_b] = [a_box, b_box].map(({ angle }) => common_size(a_box, b_box, angle ?? 0));
    if (Math.min(...as_a, ...as_b) > 2) {
      const [width, height] = as_a;
      const size = `${Math.round(width)} × ${Math.round(height)} px`;
      found.set(key, `"${pair[0].text}" and "${pair[1].text}" cover each other by ${size}`);
    }
  }
}
return [...found.values()];
