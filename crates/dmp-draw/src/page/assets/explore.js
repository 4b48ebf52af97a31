"use strict";
// All of the page can be read without this. With it tables sort and are saved, runs are switched on and off, pictures zoom and tell what is under the pointer.
(() => {
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];
  const make = (tag, attributes = {}, text = "") => {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.textContent = text;
    return element;
  };
  const save = (name, type, text) => {
    const link = make("a", { href: URL.createObjectURL(new Blob([text], { type })), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  const digits = (value) => (Math.abs(value) >= 1000 ? value.toFixed(0) : String(Number(value.toPrecision(4))));

  // Tables.
  const textOf = (cell) => cell.textContent.trim().replace(/\s+/g, " ");
  const numberOf = (text) => {
    const found = text.replace(/,(?=\d{3})/g, "").replace(/−/g, "-").match(/^[-+]?\d+(\.\d+)?(e[-+]?\d+)?/i);
    return found ? Number(found[0]) : NaN;
  };
  const sort = (table, column, ascending) => {
    const rows = [...table.tBodies[0].rows].map((row) => ({ row, text: textOf(row.cells[column]) }));
    rows.sort((a, b) => {
      const [x, y] = [numberOf(a.text), numberOf(b.text)];
      if (isNaN(x) !== isNaN(y)) return isNaN(x) ? 1 : -1;
      const order = isNaN(x) ? a.text.localeCompare(b.text) : x - y;
      return ascending ? order : -order;
    });
    table.tBodies[0].append(...rows.map(({ row }) => row));
  };
  const csv = (table) => {
    const quoted = (text) => (/[",]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text);
    const heads = all("thead th", table).map((head) => textOf(head.querySelector("button") ?? head));
    const rows = [...table.tBodies[0].rows].map((row) => [...row.cells].map(textOf));
    return [heads, ...rows].map((row) => row.map(quoted).join(",")).join("\n") + "\n";
  };
  all("table").forEach((table, number) => {
    if (!table.tBodies[0] || table.tBodies[0].rows.length < 2) return;
    all("thead th", table).forEach((head, column) => {
      const button = make("button", { type: "button", class: "sort" });
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const ascending = head.getAttribute("aria-sort") !== "ascending";
        all("th[aria-sort]", table).forEach((other) => other.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", ascending ? "ascending" : "descending");
        sort(table, column, ascending);
      });
    });
    const button = make("button", { type: "button", class: "csv" }, "CSV");
    button.addEventListener("click", () => save(`table-${number + 1}.csv`, "text/csv", csv(table)));
    table.caption?.append(" ", button);
  });
  const data = document.getElementById("dmp-report");
  const contents = document.querySelector("nav ul");
  if (data && contents) {
    const item = make("li");
    const button = make("button", { type: "button" }, "Data as JSON");
    button.addEventListener("click", () => save("dmp-report.json", "application/json", data.textContent));
    item.append(button);
    contents.append(item);
  }

  // Runs on and off: all that has their class in the section.
  all("ul.keys[data-runs] li").forEach((item, run) => {
    const section = item.closest("section");
    const own = [...item.parentElement.children].indexOf(item);
    const button = make("button", { type: "button", "aria-pressed": "true" });
    button.append(...item.childNodes);
    item.append(button);
    button.addEventListener("click", () => {
      const shown = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", String(shown));
      all(`.s${own}`, section).forEach((drawn) => drawn.classList.toggle("off", !shown));
    });
  });

  // Pictures, and how each is moved to show a place.
  const views = new Map();
  const explore = (svg) => {
    const home = svg.getAttribute("viewBox").split(" ").map(Number);
    let view = [...home];
    const show = () => svg.setAttribute("viewBox", view.join(" "));
    const at = (event) => new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const zoom = (factor, x = view[0] + view[2] / 2, y = view[1] + view[3] / 2) => {
      const width = Math.min(home[2], Math.max(home[2] / 64, view[2] / factor));
      const share = width / view[2];
      view = [x - (x - view[0]) * share, y - (y - view[1]) * share, width, view[3] * share];
      move(0, 0);
    };
    const move = (dx, dy) => {
      view[0] = Math.min(home[0] + home[2] - view[2], Math.max(home[0], view[0] + dx));
      view[1] = Math.min(home[1] + home[3] - view[3], Math.max(home[1], view[1] + dy));
      show();
    };
    views.set(svg, (x, y, width) => {
      view = [...home];
      zoom(home[2] / width, x, y);
      move(x - view[0] - view[2] / 2, y - view[1] - view[3] / 2);
    });
    const reset = () => { view = [...home]; show(); };
    svg.setAttribute("tabindex", "0");
    svg.classList.add("explored");
    svg.addEventListener("keydown", (event) => {
      const step = view[2] / 8;
      const keys = {
        "+": () => zoom(1.5), "=": () => zoom(1.5), "-": () => zoom(1 / 1.5), 0: reset,
        ArrowLeft: () => move(-step, 0), ArrowRight: () => move(step, 0), ArrowUp: () => move(0, -step), ArrowDown: () => move(0, step),
      };
      const zoomed = view[2] < home[2];
      if (event.ctrlKey || event.metaKey || !keys[event.key] || (event.key.startsWith("Arrow") && !zoomed)) return;
      event.preventDefault();
      keys[event.key]();
    });
    // The page scrolls by the wheel until a picture is chosen.
    svg.addEventListener("wheel", (event) => {
      if (document.activeElement !== svg && !event.ctrlKey) return;
      event.preventDefault();
      const { x, y } = at(event);
      zoom(event.deltaY < 0 ? 1.25 : 0.8, x, y);
    }, { passive: false });
    svg.addEventListener("dblclick", reset);
    let from = null;
    svg.addEventListener("pointerdown", (event) => {
      if (view[2] < home[2]) { from = at(event); svg.setPointerCapture(event.pointerId); }
    });
    svg.addEventListener("pointerup", () => { from = null; });
    const readout = make("output", { class: "readout" });
    svg.after(readout);
    svg.addEventListener("pointerleave", () => { readout.textContent = ""; });
    svg.addEventListener("pointermove", (event) => {
      const here = at(event);
      if (from) { move(from.x - here.x, from.y - here.y); return; }
      readout.textContent = scanAt(svg, event) ?? placeAt(svg, here) ?? valueAt(svg, here) ?? "";
    });
  };
  // A map: metres in the world of the run.
  const placeAt = (svg, { x, y }) => {
    if (!svg.dataset.map) return null;
    const [left, bottom, perMetre, height] = svg.dataset.map.split(" ").map(Number);
    // As fine as the picture is drawn: a room needs centimetres.
    const decimals = Math.max(0, Math.ceil(Math.log10(perMetre)));
    const [across, up] = [left + x / perMetre, bottom + (height - y) / perMetre];
    return `x ${across.toFixed(decimals)} m, y ${up.toFixed(decimals)} m`;
  };
  // A plot: the values of its axes.
  const valueAt = (svg, { x, y }) => {
    if (!svg.dataset.plot) return null;
    const axis = (text, pixel) => {
      const [low, high, from, to, log] = text.split(" ").map(Number);
      const value = low + ((pixel - from) / (to - from)) * (high - low);
      return digits(log ? 10 ** value : value);
    };
    const [across, up] = svg.dataset.plot.split(",");
    return `${axis(across, x)}, ${axis(up, y)}`;
  };
  // A way: the scan that is nearest to the pointer, of the runs that are shown.
  const scanAt = (svg, event) => {
    let best = null;
    for (const line of all("polyline[data-scans]:not(.off)", svg)) {
      const matrix = svg.getScreenCTM();
      const scans = line.dataset.scans.split(";");
      [...line.points].forEach((point, k) => {
        const placed = point.matrixTransform(matrix);
        const apart = Math.hypot(placed.x - event.clientX, placed.y - event.clientY);
        if (apart < 20 && (!best || apart < best.apart)) best = { apart, text: `${line.dataset.run}: ${scans[k]}` };
      });
    }
    return best?.text ?? null;
  };
  all("figure > svg").forEach(explore);

  // From a worst place to the map, and to its time.
  const ends = (text) => text.split(" ").map(Number);
  const showPlace = (svg, [x, y, radius]) => {
    const [left, bottom, perMetre, height] = ends(svg.dataset.map);
    views.get(svg)((x - left) * perMetre, height - (y - bottom) * perMetre, 3 * radius * perMetre);
  };
  const showSpan = (svg, [from, to]) => {
    const [across, up] = svg.dataset.plot.split(",").map(ends);
    const pixel = (value) => across[2] + ((value - across[0]) / (across[1] - across[0])) * (across[3] - across[2]);
    svg.querySelector(".span")?.remove();
    const band = document.createElementNS(svg.namespaceURI, "rect");
    const [x, end] = [pixel(from), pixel(to)];
    const box = { class: "span", x: x - 1, width: end - x + 2, y: Math.min(up[2], up[3]), height: Math.abs(up[3] - up[2]) };
    for (const [name, value] of Object.entries(box)) band.setAttribute(name, value);
    svg.append(band);
  };
  document.addEventListener("click", (event) => {
    const link = event.target.closest("a[data-at], a[data-span]");
    const svg = link && document.querySelector(link.hash);
    if (!svg) return;
    if (link.dataset.at) showPlace(svg, ends(link.dataset.at)); else showSpan(svg, ends(link.dataset.span));
    svg.focus({ preventScroll: true });
  });
  // What a link leads to is not hidden.
  const unfold = () => document.getElementById(location.hash.slice(1))?.closest("details")?.setAttribute("open", "");
  window.addEventListener("hashchange", unfold);
  unfold();
})();
