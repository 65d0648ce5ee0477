// Runs once, when the page is complete. Page.py gives the names used here: figures, films, limits, slices, cells, axes,
// across, seconds, bounds, prestretch, labels, outcomes, facts, sentences, ENDS.
//
// All that is shown follows from the positions of the sliders, the chosen film, the film kept beside it, and the
// quantity of the curve. A film is a slice and a cell in it.
const element = (id) => document.getElementById(id)
const sliders = across.map((_, index) => element(`across-${index}`))
const columns = axes[0].values.length
const rows = axes[1]?.values.length ?? 1
let kept = null

const digits = (value) => String(Number(value.toPrecision(4)))
const quantity = () => element("quantity").value

// Slices are numbered so that the last slider moves on first.
const slice_at = (positions) =>
  positions.reduce((slice, position, index) => slice * across[index].values.length + position, 0)
function positions_of(slice) {
  const positions = []
  for (const {values} of [...across].reverse()) {
    positions.unshift(slice % values.length)
    slice = Math.floor(slice / values.length)
  }
  return positions
}

const shown_slice = () => slice_at(sliders.map((slider) => Number(slider.value)))
function chosen_film() {
  const [cell] = cells.selected.indices
  return cell === undefined ? null : {slice: shown_slice(), cell}
}

function places_of({slice, cell}) {
  const places = [[axes[0], cell % columns]]
  if (axes.length > 1) {
    places.push([axes[1], Math.floor(cell / columns)])
  }
  positions_of(slice).forEach((position, index) => places.push([across[index], position]))
  return places.map(([axis, position]) => ({...axis, value: axis.values[position]}))
}

function value_of({slice, cell}, name) {
  const place = places_of({slice, cell}).find((axis) => axis.name === name)
  return place?.value ?? slices[slice].data[name]?.[cell] ?? NaN
}

function area_strain(film, stretch) {
  const free = value_of(film, "prestretch") || prestretch
  return (stretch / free) ** 2 - 1
}

// The curve of a film: times, fields and stretches as they are shown; none where its span is zero.
function curve_of({slice, cell}) {
  const data = slices[slice].data
  const span = data.curve_span[cell] * seconds
  const points = span > 0 ? data.curve_time.shape[1] : 0
  const unpacked = (packed, [low, high]) =>
    Array.from({length: points}, (_, index) => low + (high - low) * packed[cell * points + index] / 65535)
  return {
    time: unpacked(data.curve_time, [0, span]),
    field: unpacked(data.curve_field, bounds.field),
    stretch: unpacked(data.curve_stretch, bounds.stretch),
    ends: data.curve_ends[cell] > 0,
  }
}

function sentence_of(film, curve) {
  const outcome = value_of(film, "outcome")
  const kind = curve.ends ? "whole" : curve.time.length ? "part" : "none"
  const end = {end: curve.time.at(-1) ?? NaN, stretch: curve.stretch.at(-1) ?? NaN}
  end.strain = area_strain(film, end.stretch)
  return sentences[kind][outcome].replace(/\{(\w+)\}/g, (_, name) => digits(end[name] ?? value_of(film, name)))
}

function draw_film({curve, end, frame}, film) {
  if (film === null) {
    curve.data = {time: [], field: [], y: []}
    end.data = {time: [], y: []}
    frame.data = {left: [], right: [], bottom: [], top: []}
    return
  }
  const found = curve_of(film)
  const {time, field, stretch} = found
  const y = quantity() === "stretch" ? stretch : stretch.map((value) => area_strain(film, value))
  // Before the program the field is zero.
  curve.data = {time: [...time.slice(0, 1), ...time], field: [...time.slice(0, 1), ...field], y: [...y.slice(0, 1), ...y]}
  end.data = found.ends ? {time: time.slice(-1), y: y.slice(-1)} : {time: [], y: []}
  const at = film.slice === shown_slice() ? [film.cell] : []
  const {start, end: highest} = figures.map.y_range
  const edge = (name, otherwise) => at.map((cell) => cells.data[name]?.[cell] ?? otherwise)
  frame.data = {
    left: edge("left"), right: edge("right"), bottom: edge("bottom", start), top: edge("top", highest),
  }
}

function cell_of_table(tag, text, scope) {
  const cell = document.createElement(tag)
  cell.textContent = text
  if (scope) {
    cell.scope = scope
  }
  return cell
}

// A row for every parameter and for what has a meaning for a film's outcome.
function tabulate(shown) {
  const [head, body] = [element("values").tHead, element("values").tBodies[0]]
  head.replaceChildren()
  body.replaceChildren()
  if (shown.length === 0) {
    return
  }
  const titles = head.insertRow()
  titles.append(cell_of_table("th", "film", "col"), cell_of_table("th", "chosen", "col"))
  if (shown.length > 1) {
    titles.append(cell_of_table("th", "kept", "col"))
    titles.lastChild.className = "kept"
  }
  const lines = new Map(places_of(shown[0]).map(({label, name}) => [label, name]))
  lines.set("outcome", "outcome")
  for (const film of shown) {
    facts[value_of(film, "outcome")].forEach(([label, name]) => lines.set(label, name))
  }
  for (const [label, name] of lines) {
    const values = shown.map((film) => value_of(film, name))
    const words = values.map((value) => name === "outcome" ? outcomes[value] : isNaN(value) ? "–" : digits(value))
    if (words.some((word) => word !== "–")) {
      body.insertRow().append(cell_of_table("th", label, "row"), ...words.map((word) => cell_of_table("td", word)))
    }
  }
}

function name_curves(film) {
  const {time, field, stretch, ends} = curve_of(film)
  const last = digits(time.at(-1))
  const label = figures.trajectory.below[0].axis_label
  element("program").setAttribute("aria-label",
    `${figures.program.left[0].axis_label} against ${label}: between ${digits(Math.min(...field))} and ` +
    `${digits(Math.max(...field))} until ${last}`)
  element("trajectory").setAttribute("aria-label",
    `Stretch against ${label}: from ${digits(stretch[0])} to ${digits(stretch.at(-1))} at ${last}` +
    (ends ? `, where it ${outcomes[value_of(film, "outcome")]}` : ""))
}

function show() {
  const slice = shown_slice()
  const constant = Object.fromEntries(
    across.map(({name, values}, index) => [name, Array(rows * columns).fill(values[sliders[index].value])]))
  cells.data = {...cells.data, ...slices[slice].data, ...constant}
  sliders.forEach((slider, index) => {
    const value = String(across[index].values[slider.value])
    slider.setAttribute("aria-valuetext", value)
    element(`value-${index}`).textContent = value
  })
  show_films()
}

function show_films() {
  const film = chosen_film()
  const shown = film === null ? [] : kept === null ? [film] : [film, kept]
  films.forEach((drawn, index) => draw_film(drawn, shown[index] ?? null))
  let words = sentences.nothing
  let final = [NaN, NaN]
  if (film !== null) {
    const place = places_of(film).map(({label, value}) => `${label} = ${digits(value)}`)
    words = `${place.join(", ")}. ${sentence_of(film, curve_of(film))}`
    final = [["steady_stretch_max", "final_stretch"], ["steady_stretch_min"]].map((names) =>
      names.map((name) => value_of(film, name)).find((value) => !isNaN(value)) ?? NaN)
    if (quantity() !== "stretch") {
      final = final.map((value) => area_strain(film, value))
    }
  }
  limits.forEach((limit, index) => { limit.location = final[index] })
  figures.trajectory.left[0].axis_label = labels[quantity()]
  element("said").textContent = words
  element("curves").hidden = !shown.some((each) => curve_of(each).time.length)
  element("values").hidden = film === null
  element("keep").disabled = film === null && kept === null
  element("keep").textContent = kept === null ? "Keep to compare" : "Forget the kept film"
  if (!element("curves").hidden) {
    name_curves(shown.find((each) => curve_of(each).time.length))
  }
  tabulate(shown)
  remember()
}

// The part of the map in sight.
const sides = [[figures.map.x_range, "start"], [figures.map.x_range, "end"], [figures.map.y_range, "start"],
  [figures.map.y_range, "end"]]
const in_sight = () => sides.map(([range, side]) => range[side])
const whole = in_sight()

// The address: values of the sliders and of the chosen film by the names of the parameters, of the kept one in a list.
// Browsers warn of too many changes.
let pending
function remember() {
  clearTimeout(pending)
  pending = setTimeout(() => {
    if (address() !== location.hash) {
      history.replaceState(null, "", address())
    }
  }, 200)
}

function address() {
  const film = chosen_film()
  const parts = new URLSearchParams(across.map(({name, values}, index) => [name, values[sliders[index].value]]))
  if (film !== null) {
    places_of(film).slice(0, axes.length).forEach(({name, value}) => parts.set(name, value))
  }
  if (kept !== null) {
    parts.set("kept", places_of(kept).map(({value}) => value).join(" "))
  }
  if (quantity() !== "stretch") {
    parts.set("curve", quantity())
  }
  if (in_sight().some((value, index) => value !== whole[index])) {
    parts.set("zoom", in_sight().map((value) => Number(value.toPrecision(6))).join(" "))
  }
  return `#${parts}`
}

function recall() {
  const parts = new URLSearchParams(location.hash.slice(1))
  const nearest = ({values}, value) =>
    values.reduce((best, each, index) => Math.abs(each - value) < Math.abs(values[best] - value) ? index : best, 0)
  const given = (axis) => parts.has(axis.name) && isFinite(parts.get(axis.name))
  const cell_at = (positions) => positions[0] + columns * (positions[1] ?? 0)
  across.forEach((axis, index) => {
    if (given(axis)) {
      sliders[index].value = nearest(axis, Number(parts.get(axis.name)))
    }
  })
  const every = [...axes, ...across]
  const numbers = (name) => (parts.get(name) ?? "").split(" ").filter((value) => value !== "").map(Number)
  const values = numbers("kept")
  kept = null
  if (values.length === every.length && values.every(isFinite)) {
    const positions = every.map((axis, index) => nearest(axis, values[index]))
    kept = {slice: slice_at(positions.slice(axes.length)), cell: cell_at(positions)}
  }
  const zoom = numbers("zoom")
  const sensible = zoom.length === 4 && zoom[0] < zoom[1] && zoom[2] < zoom[3]
  sides.forEach(([range, side], index) => { range[side] = sensible ? zoom[index] : whole[index] })
  element("quantity").value = parts.get("curve") === "area_strain" ? "area_strain" : "stretch"
  const chosen = axes.every(given) ? [cell_at(axes.map((axis) => nearest(axis, Number(parts.get(axis.name)))))] : []
  cells.selected.indices = chosen
  show()
}

function move(event) {
  const [cell] = cells.selected.indices
  const [x, y] = cell === undefined ? [columns >> 1, rows >> 1] : [cell % columns, Math.floor(cell / columns)]
  const steps = {
    ArrowLeft: [x - 1, y], ArrowRight: [x + 1, y], ArrowUp: [x, y + 1], ArrowDown: [x, y - 1], Home: [0, y],
    End: [columns - 1, y],
  }
  if (!(event.key in steps) || event.target !== element("map") || event.ctrlKey || event.altKey || event.metaKey) {
    return
  }
  event.preventDefault()
  const [to_x, to_y] = cell === undefined ? [x, y] : steps[event.key]
  cells.selected.indices = [Math.min(Math.max(to_y, 0), rows - 1) * columns + Math.min(Math.max(to_x, 0), columns - 1)]
}

// Figures are drawn on canvases, which do not follow the style of the page by themselves.
function paint() {
  const style = getComputedStyle(document.documentElement)
  const colour = (name) => style.getPropertyValue(`--${name}`).trim()
  const [page, ink, line] = ["page", "ink", "line"].map(colour)
  for (const figure of Object.values(figures)) {
    figure.setv({background_fill_color: page, border_fill_color: page, outline_line_color: line})
    for (const part of [...figure.left, ...figure.below]) {
      part.setv({
        axis_label_text_color: ink, major_label_text_color: ink, axis_line_color: ink, major_tick_line_color: ink,
        minor_tick_line_color: ink,
      })
    }
    for (const grid of figure.center.filter((part) => part.type === "Grid")) {
      grid.grid_line_color = line
    }
    for (const bar of figure.above) {
      bar.setv({background_fill_color: page, title_text_color: ink, major_label_text_color: ink, bar_line_color: line})
    }
    for (const {name, glyph} of figure.renderers) {
      if (name === "ink") {
        glyph.setv(glyph.type === "Scatter" ? {fill_color: {value: ink}, line_color: {value: ink}} : {line_color: ink})
      } else if (name === "chosen" || name === "kept") {
        glyph.line_color = {value: colour(name === "kept" ? "kept" : "ink")}
      } else if (name?.endsWith("failure")) {
        glyph.line_color = {value: colour("failure")}
      } else if (name?.startsWith("outcome")) {
        const fill = colour(name.replace(" ", "-"))
        if (fill && !glyph.fill_color.field) {
          glyph.setv({fill_color: {value: fill}, line_color: {value: fill}})
        }
        glyph.hatch_color = {value: colour(`hatch-${name.split(" ")[1]}`) || ink}
      }
    }
  }
}

for (const slider of sliders) {
  slider.addEventListener("input", show)
}
element("map").addEventListener("keydown", move)
element("quantity").addEventListener("change", show_films)
element("keep").addEventListener("click", () => {
  kept = kept === null ? chosen_film() : null
  show_films()
})
cells.selected.properties.indices.change.connect(show_films)
for (const [range, side] of sides) {
  range.properties[side].change.connect(remember)
}
addEventListener("hashchange", recall)
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint)
paint()
recall()
