// What the tests ask the page: contrasts as WCAG 2.1 defines them, what sticks out, what can be focused.
() => {
  const channels = (text) => {
    const found = text.match(/[\d.]+/g).map(Number);
    return { rgb: found.slice(0, 3), alpha: found.length > 3 ? found[3] : 1 };
  };
  const luminance = (rgb) => {
    const [r, g, b] = rgb.map((c) => {
      const v = c / 255;
      return v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const contrast = (a, b) => {
    const [high, low] = [luminance(a), luminance(b)].sort((x, y) => y - x);
    return (high + 0.05) / (low + 0.05);
  };
  const ground = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const found = channels(getComputedStyle(e).backgroundColor);
      if (found.alpha > 0) return found.rgb;
    }
    return [255, 255, 255];
  };
  const shown = (e) => e.checkVisibility({ visibilityProperty: true }) && e.getClientRects().length > 0;
  const own = (e) => [...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim());

  window.measuring = {
    // every visible piece of text: its words, its colour, its contrast
    texts: () =>
      [...document.body.querySelectorAll("*")]
        .filter((e) => own(e) && !["STYLE", "title", "desc"].includes(e.tagName) && shown(e))
        .map((e) => {
          const style = getComputedStyle(e);
          const colour = e instanceof SVGElement ? style.fill : style.color;
          return {
            text: e.textContent.trim().slice(0, 40),
            colour,
            contrast: contrast(channels(colour).rgb, ground(e)),
            px: parseFloat(style.fontSize) * (e instanceof SVGElement ? Math.hypot(e.getScreenCTM().a, e.getScreenCTM().b) : 1),
          };
        }),
    // the colours in which series are drawn
    lines: () =>
      ["--blue", "--vermilion", "--green", "--ink"].map((name) => {
        const probe = document.createElement("i");
        probe.style.color = `var(${name})`;
        document.body.append(probe);
        const colour = getComputedStyle(probe).color;
        probe.remove();
        return { name, colour, contrast: contrast(channels(colour).rgb, ground(document.body)) };
      }),
    // elements that reach beyond the window, other than inside something that scrolls or clips
    beyond: () =>
      [...document.body.querySelectorAll("*")]
        .filter((e) => shown(e) && e.getBoundingClientRect().right > innerWidth + 0.5)
        .filter((e) => {
          for (let p = e.parentElement; p && p !== document.body; p = p.parentElement)
            if (getComputedStyle(p).overflowX !== "visible") return false;
          return true;
        })
        .map((e) => `${e.tagName} ${e.className} ${e.textContent.slice(0, 30)}`),
    // what a mouse can use and a keyboard must reach, in the order of the document
    interactive: () => {
      const found = [...document.body.querySelectorAll("*")].filter(
        (e) =>
          shown(e) &&
          (e.matches("a[href], button, input, select, textarea, summary, [tabindex='0']") ||
            (["auto", "scroll"].includes(getComputedStyle(e).overflowX) && e.scrollWidth > e.clientWidth)),
      );
      found.forEach((e, k) => (e.dataset.order = k));
      return found.length;
    },
    // the drawing itself, not only its frame
    figures: () =>
      [...document.querySelectorAll("svg.plot")].map((svg) => {
        const box = svg.getBoundingClientRect();
        const drawn = [...svg.querySelectorAll("path")].map((p) => p.getBoundingClientRect());
        return {
          width: box.width,
          height: box.height,
          longest: Math.max(...drawn.map((d) => d.width)),
          outside: drawn.filter((d) => d.width && (d.left < box.left - 1 || d.right > box.right + 1)).length,
          texts: svg.querySelectorAll("text").length,
        };
      }),
    numbers: (attribute) =>
      [...document.querySelectorAll(`[${attribute}]`)].map((e) => ({
        metric: e.getAttribute(attribute),
        value: e.dataset.value,
        text: e.innerText.trim(),
      })),
  };
}
