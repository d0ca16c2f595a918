// Charts zoom and tell values, tables are copied, paper is light or dark; the page is whole without all that.
// Places on an axis are values, or decimal logarithms of them.
"use strict";
(() => {
  const TOP = 18, RIGHT = 20, BOTTOM = 42;

  function make(tag, given, parent, text) {
    const name = parent instanceof SVGElement ? "http://www.w3.org/2000/svg" : "http://www.w3.org/1999/xhtml";
    const node = document.createElementNS(name, tag);
    for (const name in given) node.setAttribute(name, given[name]);
    if (text !== undefined) node.textContent = text;
    if (parent) parent.append(node);
    return node;
  }

  const minus = text => text.replace(/-/g, "−");
  const value = (axis, place) => axis.log ? 10 ** place : place;
  const named = axis => axis.unit ? `${axis.label} (${axis.unit})` : axis.label;
  const ink = s => `--l:${s.ink[0]};--d:${s.ink[1]}`;

  // a value with its unit, to a thousandth of what is shown
  function told(axis, place) {
    const v = value(axis, place), span = axis.log ? Math.abs(v) : axis.ends[1] - axis.ends[0];
    const digits = Math.ceil(Math.log10(Math.abs(v) / span + 1e-9)) + 4;
    return minus(String(Number(v.toPrecision(Math.max(2, Math.min(9, digits)))))) + (axis.unit ? " " + axis.unit : "");
  }

  // [place, label]; without a label it is a fine line
  function ticks(axis, [low, high], most) {
    const all = [], count = Math.max(2, most);
    if (axis.log && high - low >= 1) {
      const every = Math.ceil((high - low) / count), plain = low >= -3.01 && high <= 4.01;
      for (let d = Math.floor(low); d <= high; d++) for (let m = 1; m < (every > 1 ? 2 : 10); m++) {
        const raised = "10" + String(d).replace(/./g, c => c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]);
        const label = plain ? String(Number((m * 10 ** d).toPrecision(1))) : m > 1 ? m + "·" + raised : raised;
        const major = m > 1 ? high - low < 2 && (m === 2 || m === 5) : d % every === 0;
        all.push([d + Math.log10(m), major ? label : ""]);
      }
      return all.filter(t => t[0] >= low && t[0] <= high);
    }
    const from = value(axis, low), to = value(axis, high), power = 10 ** Math.floor(Math.log10((to - from) / count));
    const step = power * [1, 2, 5, 10].find(m => m * power * count >= (to - from) * 0.999);
    const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    for (let i = Math.ceil(from / step); i * step <= to && all.length < 60; i++) {
      all.push([axis.log ? Math.log10(i * step) : i * step, minus((i * step).toFixed(Math.min(places, 20)))]);
    }
    return all;
  }

  class Chart {
    constructor(box) {
      this.box = box;
      Object.assign(this, JSON.parse(box.querySelector("script").textContent));
      this.svg = box.querySelector("svg[viewBox]");
      this.axes = [this.x, this.y];
      for (const axis of this.axes) axis.all = axis.ends;
      for (const s of this.series) for (const name of ["x", "y", "high"]) s[name] = (s[name] || []).map(v => v ?? NaN);
      box.classList.add("live");
      box.tabIndex = 0;
      this.tip = make("div", { class: "tip", role: "status", hidden: "" }, box);
      this.listen();
    }

    // the frame, and the way from places to pixels and back
    layout() {
      const box = Math.max(280, this.box.clientWidth), width = this.equal ? Math.min(box, 860) : box;
      const height = this.equal ? Math.min(this.height, Math.max(300, 0.8 * width)) : this.height;
      const rough = ticks(this.y, this.y.ends, (height - 60) / 32);
      const left = 34 + 7.6 * Math.max(1, ...rough.map(t => t[1].length));
      const right = width - RIGHT, bottom = height - BOTTOM;
      const f = this.frame = { left, top: TOP, width: right - left, height: bottom - TOP, right, bottom };
      this.shown = this.axes.map(axis => axis.ends);
      if (this.equal) {
        // one unit is as long along x as along y
        const units = this.shown.map((ends, i) => (ends[1] - ends[0]) / (i ? f.height : f.width)), most = Math.max(...units);
        this.shown = this.shown.map(([a, b], i) => [-1, 1].map(side => (a + b) / 2 + side * most * (i ? f.height : f.width) / 2));
      }
      const [[x0, x1], [y0, y1]] = this.shown;
      this.toX = v => f.left + (v - x0) / (x1 - x0) * f.width;
      this.toY = v => Math.max(-height, Math.min(2 * height, f.bottom - (v - y0) / (y1 - y0) * f.height));
      this.fromX = p => x0 + (p - f.left) / f.width * (x1 - x0);
      this.fromY = p => y0 + (f.bottom - p) / f.height * (y1 - y0);
      this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
      this.svg.replaceChildren(...this.svg.querySelectorAll("title, desc"));
    }

    draw() {
      this.layout();
      const f = this.frame, root = this.svg, id = this.box.id + "-c";
      const { left: x, top: y, width, height } = f, frame = { x, y, width, height };
      const across = ticks(this.x, this.shown[0], f.width / 90), up = ticks(this.y, this.shown[1], f.height / 32);
      for (const fine of [true, false]) {
        const lines = (all, line) => all.filter(t => !t[1] === fine).map(t => line(t[0])).join("");
        const d = lines(across, v => `M${this.toX(v)} ${f.top}v${f.height}`)
          + lines(up, v => `M${f.left} ${this.toY(v)}h${f.width}`);
        make("path", { class: fine ? "grid fine" : "grid", d }, root);
      }
      make("rect", frame, make("clipPath", { id }, root));
      const marks = make("g", { "clip-path": `url(#${id})` }, root);
      const text = (x, y, words, anchor, more) =>
        make("text", { x, y, "text-anchor": anchor, ...more }, root, words);
      for (const s of this.series) {
        this.mark(s, marks);
        if (s.label && s.at > this.shown[0][0] && s.at < this.shown[0][1]) text(this.toX(s.at), f.top - 5, s.label, "middle");
      }
      make("rect", { class: "frame", ...frame }, root);
      for (const [at, words] of up) text(f.left - 7, this.toY(at) + 4.5, words, "end");
      for (const [at, words] of across) text(this.toX(at), f.bottom + 16, words, "middle");
      text(f.left + f.width / 2, f.bottom + 35, named(this.x), "middle", { class: "axis" });
      text(0, 0, named(this.y), "middle", { class: "axis", transform: `translate(14 ${f.top + f.height / 2}) rotate(-90)` });
      this.hair = make("path", { class: "hair" }, root);
    }

    mark(s, parent) {
      const f = this.frame, at = (x, y) => `${this.toX(x).toFixed(1)} ${this.toY(y).toFixed(1)}`;
      const there = i => isFinite(s.x[i] + s.y[i] + (s.high[i] ?? 0));
      let d = "";
      if (s.kind === "at_x") d = `M${this.toX(s.at)} ${f.top}v${f.height}`;
      if (s.kind === "at_y") d = `M${f.left} ${this.toY(s.at)}h${f.width}`;
      if (s.kind === "span_x") {
        const from = s.from === null ? f.left : this.toX(s.from), to = s.to === null ? f.right : this.toX(s.to);
        d = `M${from} ${f.top}H${to}V${f.bottom}H${from}Z`;
      }
      for (let i = 0; i < s.x.length; i++) {
        if (!there(i)) continue;
        const begins = i === 0 || !there(i - 1);
        if (s.kind === "line") d += (begins ? "M" : "L") + at(s.x[i], s.y[i]);
        else if (s.kind === "dots") d += `M${at(s.x[i], s.y[i])}h0`;
        else if (s.kind === "bars") d += `M${at(s.x[i], s.y[i])}L${at(s.x[i], s.high[i])}`;
        else if (begins) {
          let end = i, ring = [];
          for (; end < s.x.length && there(end); end++) ring.push(at(s.x[end], s.high[end]));
          while (--end >= i) ring.push(at(s.x[end], s.y[end]));
          d += `M${ring.join("L")}Z`;
        }
      }
      const look = s.alpha ? { class: "mark area", "fill-opacity": s.alpha } : { class: "mark line", "stroke-width": s.width };
      if (s.dash) look["stroke-dasharray"] = s.dash.join(" ");
      make("path", { d, style: ink(s), ...look }, parent);
    }

    // of each series the point nearest to a place in pixels
    nearest(px, py) {
      const found = [];
      for (const s of this.series) {
        let best = null, least = s.kind === "dots" || s.kind === "bars" ? 400 : Infinity;
        for (let i = 0; i < s.x.length; i++) {
          const away = (this.toX(s.x[i]) - px) ** 2 + (this.equal ? (this.toY(s.y[i]) - py) ** 2 : 0);
          if (away < least && isFinite(s.y[i])) [best, least] = [i, away];
        }
        if (best !== null) found.push([s, best, least]);
      }
      return this.equal ? found.sort((a, b) => a[2] - b[2]).slice(0, 1) : found;
    }

    point(px, py) {
      const f = this.frame, found = this.nearest(px, py);
      this.leave();
      if (!found.length) return;
      this.at = px;
      const [first, k] = found[0];
      make("div", {}, this.tip, `${this.x.label} ${told(this.x, this.equal ? first.x[k] : this.fromX(px))}`);
      for (const [s, i] of found) {
        const row = make("div", {}, this.tip), low = s.kind === "bars" ? [] : [s.y[i]];
        make("i", { class: "mark", style: ink(s) }, row);
        const values = low.concat(s.high[i] ?? []).map(v => told(this.y, v));
        row.append(`${s.name || this.y.label || "value"}: ${values.join(" to ")}`);
      }
      const cross = `M${this.toX(first.x[k]) - 8} ${this.toY(first.y[k])}h16m-8 -8v16`;
      this.hair.setAttribute("d", this.equal ? cross : `M${px} ${f.top}v${f.height}`);
      this.tip.hidden = false;
      const at = px * this.svg.clientWidth / (f.right + RIGHT), room = this.box.clientWidth - this.tip.offsetWidth;
      this.tip.style.left = Math.max(0, at + 14 < room ? at + 14 : at - 14 - this.tip.offsetWidth) + "px";
      this.tip.style.top = this.svg.offsetTop + TOP + 6 + "px";
    }

    leave() {
      this.tip.replaceChildren();
      this.tip.hidden = true;
      this.hair.removeAttribute("d");
    }

    // x from low to high in all charts of the figure; y is given, or follows
    zoom(low, high, y) {
      const [least, most] = this.x.all;
      if (!(high - low > 1e-5 * (most - least))) return;
      for (const chart of this.group) {
        const whole = low <= least && high >= most;
        chart.x.ends = whole ? chart.x.all : this.equal ? [low, high] : [Math.max(low, least), Math.min(high, most)];
        chart.y.ends = whole ? chart.y.all : y || chart.reach() || chart.y.all;
        chart.draw();
        chart.leave();
      }
    }

    all() { this.zoom(-Infinity, Infinity); }

    // y in view
    reach() {
      const [low, high] = this.x.ends, inside = [];
      for (const s of this.series) s.x.forEach((x, i) => {
        if (x >= low && x <= high || x < low && s.x[i + 1] > high) inside.push(s.y[i], s.high[i] ?? s.y[i]);
      });
      const ys = inside.filter(isFinite), min = Math.min(...ys), max = Math.max(...ys);
      const about = 0.05 * (max - min || Math.abs(max) || 1);
      return ys.length ? [min - about, max + about] : null;
    }

    // a view larger by `factor`, moved aside by a share of it
    view(factor, move = 0) {
      const [x, y] = this.shown.map(([a, b]) => [-1, 1].map(side => (a + b) / 2 + side * factor * (b - a) / 2));
      const aside = move * (x[1] - x[0]);
      this.zoom(x[0] + aside, x[1] + aside, this.equal ? y : null);
    }

    listen() {
      const { svg, box } = this, on = (name, act) => svg.addEventListener(name, act);
      const place = event => {
        const r = svg.getBoundingClientRect(), scale = (this.frame.right + RIGHT) / r.width;
        return [(event.clientX - r.left) * scale, (event.clientY - r.top) * scale];
      };
      let start = null, drawn = null;
      const end = () => { if (drawn) drawn.remove(); start = drawn = null; };
      on("pointerdown", event => {
        if (event.button) return;
        start = place(event);
        svg.setPointerCapture(event.pointerId);
        this.point(...start);
      });
      on("pointermove", event => {
        const [px, py] = place(event), f = this.frame;
        if (!start || !drawn && Math.abs(px - start[0]) < 6) return this.point(px, py);
        this.leave();
        drawn = drawn || make("rect", { class: "box" }, svg);
        const x = Math.max(f.left, Math.min(px, start[0])), y = this.equal ? Math.min(py, start[1]) : f.top;
        const width = Math.min(f.right, Math.max(px, start[0])) - x, height = this.equal ? Math.abs(py - start[1]) : f.height;
        drawn.area = { x, y, width: Math.max(0, width), height };
        for (const name in drawn.area) drawn.setAttribute(name, drawn.area[name]);
      });
      on("pointerup", () => {
        const area = drawn && drawn.area;
        end();
        if (!area || area.width < 6) return;
        const { x, y, width, height } = area, up = [this.fromY(y + height), this.fromY(y)];
        this.zoom(this.fromX(x), this.fromX(x + width), this.equal ? up : null);
      });
      on("pointercancel", end);
      on("pointerleave", () => start || this.leave());
      on("dblclick", () => this.all());
      box.addEventListener("keydown", event => {
        const f = this.frame, key = event.key, aside = { ArrowLeft: -1, ArrowRight: 1 }[key];
        const at = Math.max(f.left, Math.min(f.right, (this.at || f.left + f.width / 2) + aside * f.width / 100));
        if (key === "+") this.view(0.5);
        else if (key === "-") this.view(2);
        else if (key === "0") this.all();
        else if (aside && event.shiftKey) this.view(1, aside / 4);
        else if (aside) this.point(at, f.top + f.height / 2);
        else return;
        event.preventDefault();
      });
    }
  }

  // buttons after a node, by their names
  function tools(node, acts) {
    const row = make("div", { class: "tools" });
    node.after(row);
    for (const name in acts) make("button", {}, row, name).addEventListener("click", acts[name]);
    return row;
  }

  const charts = [];
  for (const figure of document.querySelectorAll("figure")) {
    const group = [...figure.querySelectorAll(".chart")].map(box => new Chart(box));
    if (!group.length) continue;
    for (const chart of group) chart.group = group;
    charts.push(...group);
    tools(figure.querySelector("h3"), {
      "Zoom in": () => group[0].view(0.5), "Zoom out": () => group[0].view(2), "Show all": () => group[0].all(),
    });
  }
  const draw = () => charts.forEach(chart => chart.draw());
  draw();
  addEventListener("resize", draw);

  for (const table of document.querySelectorAll("table")) {
    tools(table, { "Copy table": async ({ target }) => {
      const cell = c => c.innerText.replace(/−/g, "-").replace(/\s+/g, " ").trim();
      try {
        await navigator.clipboard.writeText([...table.rows].map(row => [...row.cells].map(cell).join("\t")).join("\n"));
        target.textContent = "Copied";
      } catch {
        getSelection().selectAllChildren(table);
        target.textContent = "Selected";
      }
    } });
  }

  const theme = document.documentElement.dataset;
  theme.theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  const turn = () => { theme.theme = theme.theme === "dark" ? "light" : "dark"; };
  tools(document.querySelector("main"), { "Light or dark": turn }).classList.add("theme");
})();
