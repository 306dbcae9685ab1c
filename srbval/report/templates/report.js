// Zoom and read-out for figures that carry their data: nothing is loaded, all of it is in the page.
"use strict";
(() => {
  const NS = "http://www.w3.org/2000/svg";
  const HEIGHT = 320, LEFT = 64, RIGHT = 12, TOP = 26, BOTTOM = 40;
  const STEP = 1.6; // of one press on zoom

  const make = (name, attributes, parent, text) => {
    const node = document.createElementNS(NS, name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    if (parent) parent.append(node);
    return node;
  };
  const html = (name, properties, parent) => {
    const node = Object.assign(document.createElement(name), properties);
    if (parent) parent.append(node);
    return node;
  };

  // Columns of a CSV file carried as a percent-encoded data URI; an empty field is NaN.
  const columnsOf = (uri) => {
    const [head, ...lines] = decodeURIComponent(uri.slice(uri.indexOf(",") + 1)).trim().split("\n");
    const names = head.split(",");
    const columns = Object.fromEntries(names.map((name) => [name, new Float64Array(lines.length)]));
    lines.forEach((line, row) => line.split(",").forEach((field, i) => {
      columns[names[i]][row] = field === "" ? NaN : Number(field);
    }));
    return columns;
  };

  const ticksOf = (low, high, about) => {
    const raw = (high - low) / about, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].find((m) => m * power >= raw) * power, ticks = [];
    for (let k = Math.ceil(low / step); k * step <= high; k++) ticks.push(k * step);
    return { ticks, digits: Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9))) };
  };

  const firstAtOrAfter = (sorted, value) => {
    let low = 0, high = sorted.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (sorted[middle] < value) low = middle + 1; else high = middle;
    }
    return low;
  };

  class Plot {
    constructor(figure, given) {
      this.given = given;
      this.columns = columnsOf(figure.querySelector("a.data").getAttribute("href"));
      this.x = this.columns[given.x];
      this.whole = [this.x[0], this.x[this.x.length - 1]];
      this.view = [...this.whole];
      this.at = null;
      this.box = html("div", { className: "explore" });
      this.buildButtons();
      this.svg = make("svg", { class: "plot", tabindex: "0", role: "img" }, this.box);
      this.svg.setAttribute("aria-label", `${figure.querySelector("img").alt} Arrow keys move the read-out.`);
      this.said = html("p", { className: "readout" }, this.box);
      this.said.setAttribute("role", "status");
      this.listen();
      figure.querySelector(".card").after(this.box);
      new ResizeObserver(() => this.draw()).observe(this.box);
      this.say();
    }

    buildButtons() {
      const bar = html("div", { className: "bar" }, this.box);
      const actions = [
        ["Zoom in", () => this.zoom(1 / STEP)], ["Zoom out", () => this.zoom(STEP)],
        ["Left", () => this.move(-0.25)], ["Right", () => this.move(0.25)], ["All", () => this.show(this.whole)],
      ];
      for (const [textContent, action] of actions) {
        html("button", { type: "button", textContent, onclick: action }, bar);
      }
    }

    listen() {
      const at = (event) => this.toX(event.clientX - this.svg.getBoundingClientRect().left);
      this.svg.addEventListener("pointermove", (event) => {
        if (this.from !== undefined) this.to = at(event);
        this.read(at(event));
      });
      this.svg.addEventListener("pointerdown", (event) => {
        this.from = this.to = at(event);
        this.svg.setPointerCapture(event.pointerId);
      });
      this.svg.addEventListener("pointerup", () => {
        const ends = [this.from, this.to].sort((a, b) => a - b);
        this.from = undefined;
        if (ends[1] - ends[0] > 0.01 * (this.view[1] - this.view[0])) this.show(ends); else this.draw();
      });
      this.svg.addEventListener("dblclick", () => this.show(this.whole));
      this.svg.addEventListener("keydown", (event) => {
        const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
        if (step) {
          const i = this.at === null ? firstAtOrAfter(this.x, (this.view[0] + this.view[1]) / 2) : this.at + step;
          this.read(this.x[Math.max(0, Math.min(this.x.length - 1, i))]);
        } else if (event.key === "+") this.zoom(1 / STEP);
        else if (event.key === "-") this.zoom(STEP);
        else if (event.key === "Escape") this.show(this.whole);
        else return;
        event.preventDefault();
      });
    }

    get width() { return Math.max(this.box.clientWidth, 240); }
    toX(pixel) {
      const share = Math.max(0, Math.min(1, (pixel - LEFT) / (this.width - LEFT - RIGHT)));
      return this.view[0] + share * (this.view[1] - this.view[0]);
    }
    toPixel(x) { return LEFT + ((x - this.view[0]) / (this.view[1] - this.view[0])) * (this.width - LEFT - RIGHT); }

    show([low, high]) {
      const least = (4 * (this.whole[1] - this.whole[0])) / this.x.length;
      const width = Math.max(high - low, least);
      const start = Math.max(this.whole[0], Math.min(low, this.whole[1] - width));
      this.view = [start, Math.min(start + width, this.whole[1])];
      this.draw();
    }
    zoom(times) {
      const inView = this.at !== null && this.x[this.at] >= this.view[0] && this.x[this.at] <= this.view[1];
      const middle = inView ? this.x[this.at] : (this.view[0] + this.view[1]) / 2;
      const half = ((this.view[1] - this.view[0]) / 2) * times;
      this.show([middle - half, middle + half]);
    }
    move(share) {
      const shift = share * (this.view[1] - this.view[0]);
      this.show([this.view[0] + shift, this.view[1] + shift]);
    }

    // The highest point of any curve within some pixels of where the pointer is.
    read(x) {
      const reach = (4 / (this.width - LEFT - RIGHT)) * (this.view[1] - this.view[0]);
      const first = this.columns[Object.keys(this.given.curves)[0]];
      let best = Math.min(firstAtOrAfter(this.x, x), this.x.length - 1);
      const keyed = this.x[best] === x;
      for (let i = firstAtOrAfter(this.x, x - reach); !keyed && i < this.x.length && this.x[i] <= x + reach; i++) {
        if (first[i] > first[best]) best = i;
      }
      this.at = best;
      this.say();
      this.draw();
    }

    say() {
      const { given, at } = this;
      if (at === null) {
        this.said.textContent = "Drag to zoom, point to read; + and - zoom, arrow keys read, Escape shows all.";
        return;
      }
      const x = this.x[at], parts = [`${given.x_label.replace(/,.*/, "")} ${x.toPrecision(6)}${this.unit()}`];
      if (given.x_per_order) parts.push(`order ${(x / given.x_per_order).toFixed(4)}`);
      for (const [column, label] of Object.entries(given.curves)) {
        parts.push(`${label} ${this.columns[column][at].toPrecision(4)}`);
      }
      const near = given.marks.map(([name, place]) => [name, x - place])
        .sort((a, b) => Math.abs(a[1]) - Math.abs(b[1]))[0];
      if (near) parts.push(`${near[1] < 0 ? "" : "+"}${near[1].toPrecision(3)}${this.unit()} from ${near[0]}`);
      this.said.textContent = parts.join(" · ");
    }
    unit() { return this.given.x_label.includes(", ") ? ` ${this.given.x_label.split(", ")[1]}` : ""; }

    draw() {
      const { svg, given, x, view, width } = this, names = Object.keys(given.curves);
      svg.replaceChildren();
      svg.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
      const start = Math.max(0, firstAtOrAfter(x, view[0]) - 1);
      const stop = Math.min(x.length, firstAtOrAfter(x, view[1]) + 2);
      let low = 0, high = -Infinity;
      for (const name of names) for (let i = start; i < stop; i++) {
        low = Math.min(low, this.columns[name][i]); high = Math.max(high, this.columns[name][i]);
      }
      high = high > low ? low + 1.08 * (high - low) : low + 1;
      if (low < 0) low *= 1.08;
      const floor = HEIGHT - BOTTOM;
      const toY = (value) => floor - ((value - low) / (high - low)) * (floor - TOP);
      this.axes(toY, low, high, floor);
      for (const [name, place] of given.marks) {
        if (place < view[0] || place > view[1]) continue;
        const at = this.toPixel(place);
        make("line", { class: "mark", x1: at, x2: at, y1: TOP, y2: floor }, svg);
        make("text", { class: "mark", x: 0, y: 0, transform: `translate(${at - 3} ${TOP + 2}) rotate(-90)`,
          "text-anchor": "end" }, svg, name);
      }
      names.forEach((name, i) => {
        make("path", { class: `curve c${i}`, d: this.path(this.columns[name], start, stop, toY) }, svg);
        make("text", { class: `key c${i}`, x: LEFT + 130 * i, y: 12 }, svg, given.curves[name]);
      });
      if (this.at !== null) this.cursor(toY, floor, names[0]);
      if (this.from !== undefined) {
        const [a, b] = [this.from, this.to].map((v) => this.toPixel(v)).sort((p, q) => p - q);
        make("rect", { class: "drag", x: a, y: TOP, width: b - a, height: floor - TOP }, svg);
      }
    }

    axes(toY, low, high, floor) {
      const { svg, given, view, width } = this;
      const across = ticksOf(view[0], view[1], Math.max(3, width / 110)), up = ticksOf(low, high, 5);
      for (const tick of across.ticks) {
        make("line", { class: "grid", x1: this.toPixel(tick), x2: this.toPixel(tick), y1: TOP, y2: floor }, svg);
        make("text", { x: this.toPixel(tick), y: floor + 15, "text-anchor": "middle" }, svg,
          tick.toFixed(across.digits));
      }
      for (const tick of up.ticks) {
        make("line", { class: "grid", x1: LEFT, x2: width - RIGHT, y1: toY(tick), y2: toY(tick) }, svg);
        make("text", { x: LEFT - 6, y: toY(tick) + 4, "text-anchor": "end" }, svg, tick.toFixed(up.digits));
      }
      make("text", { x: (LEFT + width) / 2, y: HEIGHT - 6, "text-anchor": "middle" }, svg, given.x_label);
      make("text", { x: 0, y: 0, transform: `translate(13 ${(TOP + floor) / 2}) rotate(-90)`,
        "text-anchor": "middle" }, svg, given.y_label);
    }

    // Least and greatest value of every pixel column: looks like all points, costs few.
    path(values, start, stop, toY) {
      const parts = [];
      let column = null, least = 0, greatest = 0;
      const close = () => { if (column !== null) parts.push(`${column} ${toY(greatest).toFixed(1)}`,
        ...(least < greatest ? [`${column} ${toY(least).toFixed(1)}`] : [])); };
      const dense = stop - start > 2 * this.width;
      for (let i = start; i < stop; i++) {
        if (Number.isNaN(values[i])) continue;
        const at = dense ? Math.round(this.toPixel(this.x[i])) : this.toPixel(this.x[i]).toFixed(1);
        if (at !== column) { close(); column = at; least = greatest = values[i]; }
        least = Math.min(least, values[i]); greatest = Math.max(greatest, values[i]);
      }
      close();
      return parts.length ? `M${parts.join("L")}` : "";
    }

    cursor(toY, floor, name) {
      const x = this.x[this.at];
      if (x < this.view[0] || x > this.view[1]) return;
      const at = this.toPixel(x);
      make("line", { class: "cursor", x1: at, x2: at, y1: TOP, y2: floor }, this.svg);
      make("circle", { class: "cursor", cx: at, cy: toY(this.columns[name][this.at]), r: 4 }, this.svg);
    }
  }

  for (const figure of document.querySelectorAll("figure[data-explore]")) {
    const label = figure.querySelector("figcaption .label"), plots = [];
    const button = html("button", { type: "button", className: "open", textContent: "Zoom" });
    button.setAttribute("aria-expanded", "false");
    button.setAttribute("aria-label", `Zoom into ${label ? label.textContent.replace(/\.$/, "") : figure.id}`);
    button.addEventListener("click", () => {
      const open = button.getAttribute("aria-expanded") === "true";
      if (!plots.length) plots.push(new Plot(figure, JSON.parse(figure.dataset.explore)));
      plots[0].box.hidden = open;
      button.setAttribute("aria-expanded", String(!open));
    });
    figure.querySelector("figcaption").append(" ", button);
  }
})();
