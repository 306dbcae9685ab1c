// Folded sections, tables that scroll, and figures to zoom into by uPlot: nothing is loaded, all of it is in the page.
"use strict";
(() => {
  const html = (name, properties, parent) => {
    const node = Object.assign(document.createElement(name), properties);
    if (parent) parent.append(node);
    return node;
  };

  // Sections: a link opens what it leads to, paper shows all, one button opens and folds all.
  const folds = [...document.querySelectorAll("details.fold")];
  const openTarget = () => {
    const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!target) return;
    for (let node = target.querySelector("details.fold") || target; node; node = node.parentElement) {
      if (node.matches("details.fold")) node.open = true;
    }
    target.scrollIntoView();
  };
  addEventListener("hashchange", openTarget);
  for (const link of document.querySelectorAll("nav a")) link.addEventListener("click", () => setTimeout(openTarget));
  openTarget();
  addEventListener("beforeprint", () => folds.forEach((fold) => { fold.open = true; }));
  if (folds.some((fold) => !fold.open)) {
    const button = html("button", { type: "button", className: "all", textContent: "Open all sections" });
    button.addEventListener("click", () => {
      const open = folds.some((fold) => !fold.open);
      folds.forEach((fold) => { fold.open = open; });
      button.textContent = open ? "Fold all sections" : "Open all sections";
    });
    document.querySelector(".sections").prepend(button);
  }

  // A table or picture wider than its place says that it scrolls.
  const watch = new ResizeObserver((entries) => entries.forEach(({ target }) => {
    target.classList.toggle("overflows", target.scrollWidth > target.clientWidth + 1);
  }));
  document.querySelectorAll(".scroll, .card.wide").forEach((box) => watch.observe(box));

  const STEP = 1.6; // of one press on zoom
  const NEAR = 6; // pixels from a named place that count as on it

  // Columns of a CSV file carried as a percent-encoded data URI; an empty field is missing.
  const columnsOf = (uri) => {
    const [head, ...lines] = decodeURIComponent(uri.slice(uri.indexOf(",") + 1)).trim().split("\n");
    const rows = lines.map((line) => line.split(","));
    const column = (i) => rows.map((row) => (row[i] === "" ? null : Number(row[i])));
    return Object.fromEntries(head.split(",").map((name, i) => [name, column(i)]));
  };
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`);

  class Zoom {
    constructor(figure, given) {
      this.given = given;
      this.names = Object.keys(given.curves);
      this.unit = given.x_label.includes(", ") ? ` ${given.x_label.split(", ")[1]}` : "";
      this.origin = figure.querySelector(".badge.measured") ? "measured" : "simulated";
      const columns = columnsOf(figure.querySelector("a.data").getAttribute("href"));
      this.x = columns[given.x];
      this.whole = [this.x[0], this.x[this.x.length - 1]];
      this.box = html("div", { className: "explore" });
      const bar = html("div", { className: "bar" }, this.box);
      const actions = [
        ["Zoom in", () => this.zoom(1 / STEP)], ["Zoom out", () => this.zoom(STEP)],
        ["Left", () => this.move(-0.25)], ["Right", () => this.move(0.25)], ["All", () => this.show(this.whole)],
      ];
      for (const [textContent, onclick] of actions) html("button", { type: "button", textContent, onclick }, bar);
      this.place = html("div", { className: "plot", tabIndex: 0 }, this.box);
      this.place.setAttribute("role", "img");
      this.place.setAttribute("aria-label", `${figure.querySelector("img").alt} Arrow keys move the read-out.`);
      this.readout = html("p", { className: "readout" }, this.box);
      this.readout.setAttribute("role", "status");
      this.readout.textContent = "Drag to zoom, point to read; + and - zoom, arrow keys read, Escape shows all.";
      figure.querySelector(".card").after(this.box);
      this.plot = new uPlot(this.options(), [this.x, ...this.names.map((name) => columns[name])], this.place);
      this.place.addEventListener("keydown", (event) => this.press(event));
      new ResizeObserver(() => this.plot.setSize({ width: this.place.clientWidth, height: 320 })).observe(this.place);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.plot.redraw());
    }

    options() {
      const axis = (label, size) => ({
        label, size, labelSize: 22, font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif",
        stroke: () => colour("ink"), grid: { stroke: () => colour("line"), width: 1 }, ticks: { show: false },
      });
      const looks = [{ stroke: () => colour(this.origin) }, { stroke: () => colour("soft"), dash: [4, 2] },
        { stroke: () => colour("published") }];
      return {
        width: Math.max(this.place.clientWidth, 240), height: 320, legend: { show: false },
        scales: { x: { time: false }, y: { range: (_, low, high) => [Math.min(0, 1.08 * low), 1.08 * high] } },
        axes: [axis(this.given.x_label, 34), axis(this.given.y_label, 56)],
        series: [{}, ...this.names.map((_, i) => ({ width: 1.4, points: { show: false }, ...looks[i % 3] }))],
        cursor: { y: false, dataIdx: (plot, series, hovered, x) => this.highest(plot, hovered, x) },
        hooks: {
          setCursor: [(plot) => { if (plot.cursor.idxs[1] != null) this.read(plot.cursor.idxs[1]); }],
          setScale: [(plot, key) => { if (key === "x") this.box.dataset.shown = [plot.scales.x.min, plot.scales.x.max]; }],
          draw: [(plot) => this.drawMarks(plot)],
        },
      };
    }

    // The highest point of the first curve within some pixels of where the pointer is.
    highest(plot, hovered, x) {
      const { min, max } = plot.scales.x, reach = (4 / plot.over.clientWidth) * (max - min), values = plot.data[1];
      let best = hovered;
      const look = (step) => {
        for (let i = hovered; i >= 0 && i < this.x.length && Math.abs(this.x[i] - x) <= reach; i += step) {
          if (values[i] > values[best]) best = i;
        }
      };
      if (!this.byKey) { look(1); look(-1); }
      return best;
    }

    drawMarks({ ctx, bbox, valToPos }) {
      ctx.save();
      ctx.strokeStyle = ctx.fillStyle = colour("good");
      ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
      ctx.textAlign = "right";
      for (const [name, place] of this.given.marks) {
        const at = valToPos(place, "x", true);
        if (at < bbox.left || at > bbox.left + bbox.width) continue;
        ctx.setLineDash([5 * devicePixelRatio, 4 * devicePixelRatio]);
        ctx.beginPath();
        ctx.moveTo(at, bbox.top);
        ctx.lineTo(at, bbox.top + bbox.height);
        ctx.stroke();
        ctx.save();
        ctx.translate(at - 3 * devicePixelRatio, bbox.top + 2);
        ctx.rotate(-Math.PI / 2);
        ctx.fillText(name, 0, 0);
        ctx.restore();
      }
      ctx.restore();
    }

    get view() { return [this.plot.scales.x.min, this.plot.scales.x.max]; }
    show([low, high]) {
      const width = Math.max(high - low, (4 * (this.whole[1] - this.whole[0])) / this.x.length);
      const min = Math.max(this.whole[0], Math.min(low, this.whole[1] - width));
      this.plot.setScale("x", { min, max: Math.min(min + width, this.whole[1]) });
    }
    zoom(times) {
      const [low, high] = this.view, x = this.x[this.at];
      const middle = x >= low && x <= high ? x : (low + high) / 2, half = ((high - low) / 2) * times;
      this.show([middle - half, middle + half]);
    }
    move(share) {
      const [low, high] = this.view, shift = share * (high - low);
      this.show([low + shift, high + shift]);
    }

    press(event) {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (step) {
        const i = this.at === undefined ? Math.round(this.x.length / 2) : this.at + step;
        this.at = Math.max(0, Math.min(this.x.length - 1, i));
        this.byKey = true; // exactly there, not the highest near it
        this.plot.setCursor({ left: this.plot.valToPos(this.x[this.at], "x"), top: 0 });
        this.byKey = false;
      } else if (event.key === "+") this.zoom(1 / STEP);
      else if (event.key === "-") this.zoom(STEP);
      else if (event.key === "Escape") this.show(this.whole);
      else return;
      event.preventDefault();
    }

    // What stands there: the named line, frequency, order, the value of each curve.
    read(at) {
      this.at = at;
      const { given, unit } = this, x = this.x[at], [low, high] = this.view;
      const order = (value) => (given.x_per_order ? `, order ${(value / given.x_per_order).toFixed(3)}` : "");
      const parts = [`${given.x_label.replace(/,.*/, "")} ${x.toPrecision(6)}${unit}${order(x)}`];
      this.names.forEach((name, i) => {
        const value = this.plot.data[i + 1][at];
        if (value != null) parts.push(`${given.curves[name]} ${value.toPrecision(4)}`);
      });
      const near = given.marks.map(([name, place]) => [name, place, x - place])
        .sort((a, b) => Math.abs(a[2]) - Math.abs(b[2]))[0];
      if (near && Math.abs(near[2]) < (NEAR / this.plot.over.clientWidth) * (high - low)) {
        parts.unshift(`${near[0]}, expected at ${near[1].toPrecision(6)}${unit}${order(near[1])}`);
      } else if (near) parts.push(`${near[2] < 0 ? "" : "+"}${near[2].toPrecision(3)}${unit} from ${near[0]}`);
      this.readout.textContent = parts.join(" · ");
    }
  }

  for (const figure of document.querySelectorAll("figure[data-explore]")) {
    const label = figure.querySelector("figcaption .label");
    const button = html("button", { type: "button", className: "open", textContent: "Zoom and read" });
    let zoom;
    button.setAttribute("aria-expanded", "false");
    button.setAttribute("aria-label", `Zoom and read: ${label ? label.textContent.replace(/\.$/, "") : figure.id}`);
    button.addEventListener("click", () => {
      const open = button.getAttribute("aria-expanded") === "true";
      zoom ||= new Zoom(figure, JSON.parse(figure.dataset.explore));
      zoom.box.hidden = open;
      button.setAttribute("aria-expanded", String(!open));
    });
    figure.querySelector("figcaption").append(" ", button);
  }
})();
