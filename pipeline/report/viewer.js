// Draws the mechanism in 3D as SVG; drag turns it, the slider scales the displacement. No library.
(function () {
  "use strict";
  const cases = JSON.parse(document.getElementById("shapes").textContent);
  const box = document.getElementById("viewer");
  if (!cases.length || !box) return;
  const NS = "http://www.w3.org/2000/svg";
  const W = 1000, H = 440;
  const planar = cases.every((c) => c.planar);
  let turn = planar ? 0 : -0.9, tilt = planar ? Math.PI / 2 : 0.95, chosen = 0, gain = 1;

  box.replaceChildren();
  const svg = document.createElementNS(NS, "svg");
  svg.setAttribute("viewBox", `0 0 ${W} ${H}`);
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", "the displaced mechanism over the mechanism at rest");
  const controls = document.createElement("div");
  controls.className = "controls";
  const select = document.createElement("select");
  cases.forEach((c, i) => select.add(new Option(c.label, i)));
  const slider = Object.assign(document.createElement("input"), { type: "range", min: 0, max: 2, step: 0.02, value: 1 });
  const shown = document.createElement("span");
  const hint = Object.assign(document.createElement("span"), { textContent: "drag to turn" });
  const caseLabel = document.createElement("label"), gainLabel = document.createElement("label");
  caseLabel.append("case ", select);
  gainLabel.append("displacement ", slider, " ", shown);
  controls.append(caseLabel, gainLabel, hint);
  box.append(svg, controls);

  function project(p) {
    const c = Math.cos(turn), s = Math.sin(turn), e = Math.sin(tilt), f = Math.cos(tilt);
    const x = c * p[0] - s * p[1], y = s * p[0] + c * p[1];
    return [x, -(e * y + f * p[2])];
  }

  function add(kind, attributes, text) {
    const node = document.createElementNS(NS, kind);
    for (const key in attributes) node.setAttribute(key, attributes[key]);
    if (text) node.textContent = text;
    svg.append(node);
  }

  function moved(item, factor) {
    return item.rest.map((v, i) => v + factor * item.move[i]);
  }

  function draw() {
    const now = cases[chosen], factor = now.factor * gain;
    const flat = now.lines.flatMap((l) => l.rest);
    const middle = [0, 1, 2].map((i) => (Math.min(...flat.map((p) => p[i])) + Math.max(...flat.map((p) => p[i]))) / 2);
    const seen = now.lines.flatMap((l) => l.rest.concat(l.rest.map((p, i) => moved({ rest: p, move: l.move[i] }, 2 * now.factor))));
    const reach = Math.max(...seen.map((p) => Math.hypot(...p.map((v, i) => v - middle[i]))));
    const zoom = (0.5 * H - 26) / (0.88 * reach);
    const place = (p) => {
      const q = project(p.map((v, i) => v - middle[i]));
      return [W / 2 + zoom * q[0], H / 2 + zoom * q[1]];
    };
    const path = (points) => points.map((p) => place(p).map((v) => v.toFixed(1)).join(",")).join(" ");
    svg.replaceChildren();
    for (const l of now.lines)
      add("polyline", { points: path(l.rest), fill: "none", stroke: "#94a3b8", "stroke-width": 1.8, "stroke-dasharray": "7 4", "stroke-linejoin": "round" });
    for (const l of now.lines) {
      const points = l.rest.map((p, i) => moved({ rest: p, move: l.move[i] }, factor));
      add("polyline", { points: path(points), fill: "none", stroke: l.rigid ? "#0f172a" : "#1d4ed8", "stroke-width": l.rigid ? 4 : 3, "stroke-linecap": "round", "stroke-linejoin": "round" });
    }
    for (const p of now.anchors) {
      const [x, y] = place(p);
      add("rect", { x: x - 5, y: y - 5, width: 10, height: 10, fill: "#475569" });
    }
    const taken = [];
    for (const a of now.arrows) {
      const foot = moved(a, factor), head = foot.map((v, i) => v + 0.12 * now.size * a.direction[i]);
      const [x1, y1] = place(foot), [x2, y2] = place(head);
      const angle = Math.atan2(y2 - y1, x2 - x1), wing = (t) => `${x2 - 11 * Math.cos(angle + t)},${y2 - 11 * Math.sin(angle + t)}`;
      add("line", { x1, y1, x2, y2, stroke: "#c2410c", "stroke-width": 2 });
      add("polygon", { points: `${x2},${y2} ${wing(0.4)} ${wing(-0.4)}`, fill: "#c2410c" });
      const text = { x: x2 + 8 * Math.cos(angle), y: y2 + 8 * Math.sin(angle) + 5 };
      while (taken.some((t) => Math.abs(t.x - text.x) < 45 && Math.abs(t.y - text.y) < 15)) text.y -= 16;
      taken.push(text);
      add("text", { x: text.x, y: text.y, fill: "#c2410c", "font-size": 15, "text-anchor": Math.cos(angle) < -0.3 ? "end" : "start" }, a.label);
    }
    [[1, 0, 0], [0, 1, 0], [0, 0, 1]].forEach((axis, i) => {
      const q = project(axis);
      if (Math.hypot(...q) < 0.05) return; // it points at the reader
      add("line", { x1: 60, y1: H - 60, x2: 60 + 34 * q[0], y2: H - 60 + 34 * q[1], stroke: "#475569", "stroke-width": 1.5 });
      add("text", { x: 55 + 48 * q[0], y: H - 55 + 48 * q[1], fill: "#475569", "font-size": 14 }, "xyz"[i]);
    });
    const bar = 10 ** Math.floor(Math.log10(now.size / 3));
    add("line", { x1: W - 60 - zoom * bar, y1: H - 40, x2: W - 60, y2: H - 40, stroke: "#475569", "stroke-width": 2 });
    add("text", { x: W - 60 - (zoom * bar) / 2, y: H - 48, fill: "#475569", "font-size": 14, "text-anchor": "middle" }, `${bar} mm`);
    shown.textContent = `× ${Number(factor.toPrecision(3))}`;
  }

  let last = null;
  svg.addEventListener("pointerdown", (e) => { last = [e.clientX, e.clientY]; svg.setPointerCapture(e.pointerId); });
  svg.addEventListener("pointerup", () => { last = null; });
  svg.addEventListener("pointermove", (e) => {
    if (!last) return;
    turn += (e.clientX - last[0]) * 0.008;
    tilt = Math.min(Math.PI / 2, Math.max(0, tilt + (e.clientY - last[1]) * 0.006));
    last = [e.clientX, e.clientY];
    draw();
  });
  select.addEventListener("change", () => { chosen = Number(select.value); draw(); });
  slider.addEventListener("input", () => { gain = Number(slider.value); draw(); });
  draw();
})();
