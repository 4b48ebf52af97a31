// Does with a page all that a reader can do with it, and returns what each did, in pictures, tables and maps that turn. What a page
// has none of is not in the answer.
(async () => {
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];
  const key = (element, name) => element.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true }));
  const point = (element, x, y) => element.dispatchEvent(new PointerEvent("pointermove", { clientX: x, clientY: y, bubbles: true }));
  const found = {};

  // Sorted by its last column, one way and the other.
  const table = all("table").find((table) => table.querySelector("button.sort"));
  if (table) {
    const rows = () => [...table.tBodies[0].rows];
    const button = all("button.sort", table).at(-1);
    const before = rows().length;
    const cells = () => { button.click(); return rows().map((row) => row.cells[row.cells.length - 1].textContent.trim()); };
    const [up, down] = [cells(), cells()];
    found.sort = { rows: [before, rows().length], sorted: button.closest("th").getAttribute("aria-sort"), up, down };
  }

  // Every run switched off, and on again.
  const shown = (section, run) => all(`.s${run}`, section).filter((drawn) => getComputedStyle(drawn).display !== "none").length;
  found.toggles = all("ul.keys[data-runs]").flatMap((keys) => [...keys.children].map((item, run) => {
    const section = keys.closest("section");
    const [before, button] = [shown(section, run), item.querySelector("button")];
    button.click();
    const off = shown(section, run);
    button.click();
    return [before, off, shown(section, run)];
  }));

  // Every picture: what is under the pointer, nearer, aside, and back.
  found.pictures = [];
  for (const svg of all("figure > svg.explored")) {
    svg.closest("details")?.setAttribute("open", "");
    svg.scrollIntoView({ block: "center" });
    const box = svg.getBoundingClientRect();
    if (box.width === 0) continue;
    const line = svg.querySelector("polyline[data-scans]");
    const middle = line && line.points[line.points.length >> 1].matrixTransform(svg.getScreenCTM());
    point(svg, middle ? middle.x : box.left + box.width / 2, middle ? middle.y : box.top + box.height / 2);
    const pointed = svg.nextElementSibling.textContent;
    const view = () => svg.getAttribute("viewBox").split(" ").map(Number);
    const home = view();
    key(svg, "+");
    const near = view();
    key(svg, "ArrowRight");
    const aside = view();
    key(svg, "0");
    const is = line ? "way" : svg.dataset.map ? "map" : svg.dataset.plot ? "plot" : "other";
    found.pictures.push({ is, pointed, zoom: home[2] / near[2], moved: aside[0] - near[0], back: view().every((x, k) => x === home[k]) });
  }

  // From the first worst place to the map and to its time.
  const link = document.querySelector("a[data-at]");
  if (link) {
    const map = document.querySelector(link.hash);
    const before = map.getAttribute("viewBox").split(" ").map(Number);
    link.closest("details")?.setAttribute("open", "");
    link.click();
    found.jump = before[2] / map.getAttribute("viewBox").split(" ").map(Number)[2];
    const time = document.querySelector("a[data-span]");
    time?.click();
    found.bands = all("svg .span").length;
  }

  // The map that turns: pixels that are drawn, and whether they are others when it has turned.
  const canvas = document.querySelector(".turned canvas");
  if (canvas) {
    canvas.scrollIntoView({ block: "center" });
    // Copied in the frame in which it is drawn: what is drawn is not kept.
    const pixels = async (name) => {
      key(canvas, name);
      await new Promise((done) => requestAnimationFrame(done));
      const copy = document.createElement("canvas");
      [copy.width, copy.height] = [canvas.width, canvas.height];
      const plane = copy.getContext("2d");
      plane.drawImage(canvas, 0, 0);
      return plane.getImageData(0, 0, copy.width, copy.height).data;
    };
    const drawn = (data) => data.filter((value, k) => k % 4 === 3 && value > 0).length;
    const home = await pixels("0");
    const turned = await pixels("ArrowLeft");
    found.turned = { drawn: drawn(home), moved: home.some((value, k) => value !== turned[k]) };
    await pixels("0");
  }
  return found;
})()
