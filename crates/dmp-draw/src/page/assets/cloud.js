"use strict";
// The maps in three dimensions: turned by dragging or the arrow keys, nearer by the wheel, + and -, moved with Shift. Without WebGL the picture stays.
(() => {
  const make = (tag, attributes = {}, text = "") => {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.textContent = text;
    return element;
  };
  const VERTEX = `attribute vec3 place; attribute float kind; uniform mat4 view; uniform float cut, size; uniform vec3 colours[14]; varying vec3 colour;
    void main() { gl_Position = view * vec4(place, 1.0); if (place.z > cut) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = clamp(size / gl_Position.w, 1.5, 12.0); colour = colours[int(kind + 0.5)]; }`;
  const FRAGMENT = "precision mediump float; varying vec3 colour; void main() { gl_FragColor = vec4(colour, 1.0); }";

  const start = (figure) => {
    const canvas = make("canvas", { tabindex: "0", role: "img" });
    const gl = canvas.getContext("webgl", { antialias: true });
    if (!gl) return;
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return;
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    const uniform = (name) => gl.getUniformLocation(program, name);
    const colours = figure.dataset.colours.split(" ").flatMap((hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255));
    gl.uniform3fv(uniform("colours"), colours);

    // A run: its points, where they end, its worst places; lengths are parts of the whole.
    const WHOLE = 65535;
    const runs = [...figure.querySelectorAll("script")].map((script) => {
      const bytes = Uint8Array.from(atob(script.textContent), (letter) => letter.charCodeAt(0));
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, bytes, gl.STATIC_DRAW);
      const ends = script.dataset.ends.split(" ").map((steps) => steps / WHOLE);
      const places = script.dataset.places.split(";").filter(Boolean).map((text) => {
        const [number, ...steps] = text.split(" ").map(Number);
        return { number, at: steps.map((step) => step / WHOLE) };
      });
      // Where nearly all points lie: a few far ones do not make a dot of the rest.
      const [steps, count] = [new Uint16Array(bytes.buffer), Math.min(2000, bytes.length / 8)];
      const middle = [0, 1, 2].map((axis) => {
        const values = Float32Array.from({ length: count }, (_, k) => steps[4 * Math.floor((k * bytes.length) / 8 / count) + axis] / WHOLE).sort();
        return [0.02, 0.98].map((share) => values[Math.floor(share * (values.length - 1))]);
      });
      const metre = Number(figure.dataset.metre) / (script.dataset.step * WHOLE);
      return { number: Number(script.dataset.run), name: script.dataset.name, buffer, middle, points: bytes.length / 8, low: ends.slice(0, 3), high: ends.slice(3), highest: script.dataset.highest / WHOLE, places, metre };
    });
    const frame = make("div", { class: "turned" });
    const labels = make("div");
    frame.append(canvas, labels);
    figure.querySelector("img").replaceWith(frame);
    const caption = figure.querySelector("figcaption");
    const bar = make("div", { class: "bar" });
    const chosen = make("select", { "aria-label": "Run" });
    runs.forEach((run, k) => chosen.append(make("option", { value: k }, run.name)));
    const cut = make("input", { type: "range", min: "0", max: "1000", value: "1000", "aria-label": "Hide what is higher" });
    bar.append(chosen, make("span", { class: "words" }, "cut off from above"), cut);
    frame.before(bar);

    let run, target, distance, yaw, pitch;
    const reset = () => {
      target = run.middle.map(([low, high]) => (low + high) / 2);
      distance = 1.3 * Math.max(...run.middle.map(([low, high]) => high - low), 1e-6);
      [yaw, pitch] = [Math.PI / 6, 0.7];
    };
    const choose = (k) => {
      run = runs[k];
      chosen.value = String(k);
      gl.bindBuffer(gl.ARRAY_BUFFER, run.buffer);
      for (const [name, count, type, from] of [["place", 3, gl.UNSIGNED_SHORT, 0], ["kind", 1, gl.UNSIGNED_BYTE, 6]]) {
        const at = gl.getAttribLocation(program, name);
        gl.enableVertexAttribArray(at);
        gl.vertexAttribPointer(at, count, type, type === gl.UNSIGNED_SHORT, 8, from);
      }
      canvas.setAttribute("aria-label", `Map of ${run.name} in three dimensions`);
      caption.textContent = `${run.name}: drag to turn, with Shift to move, wheel or + and - to come nearer, 0 or a double click for all`;
      labels.replaceChildren(...run.places.map(({ number }) => make("a", { href: `#place-${run.number}-${number}` }, number)));
      reset();
      draw();
    };
    // From the eye: right, up and ahead.
    const axes = () => {
      const [sy, cy, sp, cp] = [Math.sin(yaw), Math.cos(yaw), Math.sin(pitch), Math.cos(pitch)];
      return [[cy, -sy, 0], [sy * sp, cy * sp, cp], [sy * cp, cy * cp, -sp]];
    };
    let waiting = false;
    const draw = () => {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => { waiting = false; paint(); });
    };
    const paint = () => {
      const ratio = window.devicePixelRatio || 1;
      const [width, height] = [canvas.clientWidth, canvas.clientHeight];
      if (!width || !height) return;
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
      gl.viewport(0, 0, canvas.width, canvas.height);
      const [right, up, ahead] = axes();
      const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
      const focal = 1.6;
      const [across, near, far] = [focal * height / width, distance / 50, distance * 50];
      const [a, b] = [(far + near) / (far - near), (-2 * far * near) / (far - near)];
      const rows = [[...right, -dot(right, target)], [...up, -dot(up, target)], [...ahead, distance - dot(ahead, target)]];
      const matrix = [0, 1, 2, 3].flatMap((k) => [across * rows[0][k], focal * rows[1][k], a * rows[2][k] + (k === 3 ? b : 0), rows[2][k]]);
      gl.uniformMatrix4fv(uniform("view"), false, matrix);
      gl.uniform1f(uniform("cut"), run.low[2] + (run.high[2] - run.low[2]) * (cut.value / 1000) + 1e-5);
      // A point is as large as what it stands for, about.
      const [wide, deep] = run.middle.map(([low, high]) => high - low);
      gl.uniform1f(uniform("size"), Math.sqrt((wide * deep) / run.points) * focal * canvas.height * 0.6);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.drawArrays(gl.POINTS, 0, run.points);
      run.places.forEach(({ at }, k) => {
        const to = [right, up, ahead].map((axis) => dot(axis, at) - dot(axis, target));
        const depth = to[2] + distance;
        const [x, y] = [0.5 + (across * to[0]) / depth / 2, 0.5 - (focal * to[1]) / depth / 2];
        const label = labels.children[k];
        label.hidden = depth < near || x < 0.02 || x > 0.98 || y < 0.02 || y > 0.98;
        label.style.left = `${100 * x}%`;
        label.style.top = `${100 * y}%`;
      });
    };
    const turn = (x, y) => {
      yaw += x;
      pitch = Math.min(Math.PI / 2, Math.max(-0.2, pitch + y));
      draw();
    };
    const move = (x, y) => {
      const [right, up] = axes();
      const step = distance / 1.6;
      target = target.map((value, axis) => value - step * (x * right[axis] - y * up[axis]));
      draw();
    };
    const nearer = (factor) => {
      distance = Math.min(8, Math.max(2 * run.metre, distance / factor));
      draw();
    };
    canvas.addEventListener("keydown", (event) => {
      const by = event.shiftKey ? (x, y) => move(-x / 2, -y / 2) : turn;
      const keys = {
        ArrowLeft: () => by(-0.1, 0), ArrowRight: () => by(0.1, 0), ArrowUp: () => by(0, 0.1), ArrowDown: () => by(0, -0.1),
        "+": () => nearer(1.25), "=": () => nearer(1.25), "-": () => nearer(0.8), 0: () => { reset(); draw(); },
      };
      if (event.ctrlKey || event.metaKey || !keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
    canvas.addEventListener("wheel", (event) => {
      // The page scrolls by the wheel until the map is chosen.
      if (document.activeElement !== canvas && !event.ctrlKey) return;
      event.preventDefault();
      nearer(event.deltaY < 0 ? 1.15 : 1 / 1.15);
    }, { passive: false });
    canvas.addEventListener("dblclick", () => { reset(); draw(); });
    let from = null;
    canvas.addEventListener("pointerdown", (event) => {
      from = event;
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointerup", () => { from = null; });
    canvas.addEventListener("pointermove", (event) => {
      if (!from) return;
      const [x, y] = [event.clientX - from.clientX, event.clientY - from.clientY].map((px) => px / canvas.clientHeight);
      from = event;
      if (event.shiftKey) move(x, y); else turn(3 * x, 3 * y);
    });
    chosen.addEventListener("change", () => choose(Number(chosen.value)));
    cut.addEventListener("input", draw);
    new ResizeObserver(draw).observe(canvas);
    // From a worst place to here.
    document.addEventListener("click", (event) => {
      const link = event.target.closest("a[data-cloud]");
      if (!link) return;
      const [number, place] = link.dataset.cloud.split(" ").map(Number);
      const k = runs.findIndex((run) => run.number === number);
      const found = runs[k]?.places.find((one) => one.number === place);
      if (!found) return;
      choose(k);
      target = [...found.at];
      distance = 60 * run.metre;
      draw();
      canvas.focus({ preventScroll: true });
    });
    choose(0);
    // Indoors the ceiling would hide it all.
    if (Number(figure.dataset.metre) < 1) {
      cut.value = String(1000 * Math.min(1, (run.highest - run.low[2]) / Math.max(run.high[2] - run.low[2], 1e-6) + 0.05));
    }
  };
  document.querySelectorAll("figure.cloud").forEach(start);
})();
