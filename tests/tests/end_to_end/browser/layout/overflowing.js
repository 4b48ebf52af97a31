const page = document.scrollingElement;
const found = [];
if (page.scrollWidth > innerWidth) {
  found.push(`the page is ${page.scrollWidth} px wide in a window of ${innerWidth} px`);
}
const outside = box => box.right > innerWidth + 1 || (box.left < -1 && box.right > 0);
const may_scroll = element => ancestors(element).some(scrolls);
const span = box => `from ${Math.round(box.left)} to ${Math.round(box.right)} px in a window of ${innerWidth} px`;

// Each element that reaches further than the one around it.
for (const element of document.body.querySelectorAll('*')) {
  // What is drawn in a picture is cut off at its edge.
  if (element.ownerSVGElement || !visible(element)) continue;
  const box = element.getBoundingClientRect(), around = element.parentElement.getBoundingClientRect();
  const further = element.parentElement === document.body || !outside(around)
    || box.right > around.right + 1 || box.left < around.left - 1;
  if (outside(box) && further && !is_unseen(box, element) && !may_scroll(element)) {
    found.push(`${named(element)} goes ${span(box)}`);
  }
}
for (const { text, element, boxes } of texts()) {
  if (element.ownerSVGElement) {
    const edge = element.ownerSVGElement;
    const picture = edge.getBoundingClientRect();
    const cut = boxes.some(box => box.left < picture.left - 2 || box.right > picture.right + 2
      || box.top < picture.top - 2 || box.bottom > picture.bottom + 2);
    if (cut && overflow(edge) !== 'visible') found.push(`the text "${text}" is cut off by its picture`);
  } else if (!outside(element.getBoundingClientRect()) && !scrolls(element) && !may_scroll(element)) {
    const box = boxes.find(outside);
    if (box) found.push(`the text "${text}" goes ${span(box)}`);
  }
}
return found;
