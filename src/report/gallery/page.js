"use strict";
(() => {
  const gallery = document.getElementById("gallery");
  const controls = document.getElementById("controls");
  if (!gallery || !controls) return;
  const cards = Array.from(gallery.children);
  const order = document.getElementById("order");
  const boxes = Array.from(controls.querySelectorAll("input[type=checkbox]"));
  const downwards = { contam: true };
  const number = (card, key) => (key in card.dataset ? Number(card.dataset[key]) : null);
  const place = (card) => Number(card.dataset.place);
  const show = () => {
    const key = order.value;
    const sign = downwards[key] ? -1 : 1;
    const sorted = cards.slice().sort((a, b) => {
      const [x, y] = [number(a, key), number(b, key)];
      if (x === null || y === null) return (x === null) - (y === null) || place(a) - place(b);
      return sign * (x - y) || place(a) - place(b);
    });
    const wanted = new Set(boxes.filter((box) => box.checked).map((box) => box.value));
    let shown = 0;
    for (const card of sorted) {
      card.hidden = !wanted.has(card.dataset.verdict);
      shown += card.hidden ? 0 : 1;
      gallery.appendChild(card);
    }
    document.getElementById("shown").textContent = `${shown} of ${cards.length} shown`;
  };
  controls.addEventListener("submit", (event) => event.preventDefault());
  controls.addEventListener("change", show);
  controls.hidden = false;
  show();
})();
