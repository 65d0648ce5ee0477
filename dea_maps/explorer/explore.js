// All that is shown follows from the position of the slider and the chosen cell.
const position = slider === null ? 0 : slider.categories.indexOf(slider.value)
const slice = slices[position].data
if (cb_obj !== cells.selected) {
  cells.data = {...cells.data, ...slice}
}

const digits = (value) => String(Number(value.toPrecision(4)))
const [cell] = cells.selected.indices
let times = [], stretches = [], end = {time: [], stretch: []}
let words = words_of.nothing
if (cell !== undefined) {
  const outcome = slice.outcome[cell]
  const span = slice.curve_span[cell] * unit
  words = outcome in words_of ? words_of[outcome] : words_of.no_curve
  if (span > 0) {
    const points = slice.curve_time.shape[1]
    const share = (packed) => Array.from({length: points}, (_, index) => packed[cell * points + index] / 65535)
    times = share(slice.curve_time).map((value) => value * span)
    stretches = share(slice.curve_stretch).map((value) => 1 + value * (top_stretch - 1))
    words = words_of.curve[outcome]
    if (ENDS.includes(outcome)) {
      end = {time: times.slice(-1), stretch: stretches.slice(-1)}
    }
  }
  const values = {end: digits(span), stretch: digits(stretches.at(-1) ?? 1)}
  words = words.replace(/\{(\w+)\}/g, (_, name) => values[name])
  const place = parameters.map(([label, name]) => `${label} = ${digits(cells.data[name][cell])}`)
  words = `<b>${place.join(", ")}</b><br>${words}`
}
said.text = words
plot.visible = times.length > 0
if (plot.visible) {
  curve.data = {time: times, stretch: stretches}
  failure.data = end
  final_line.location = slice.final_stretch?.[cell] ?? NaN
}
