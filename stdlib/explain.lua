-- explain: where a result came from: the derivation, the definition used, the source.
-- explanations.lua does it, and is read when it is first used.

doc { name = "explain", module = "help", sig = "explain(value)",
  text = [[Where a result came from: what it is, its derivation, the definition used, the source. For models
    (with the form they were reduced to), starts, solutions, fits, tableaus and other values, and for error
    texts: pcall returns one.]],
  example = 'explain "init: 2 initial values are neither fixed nor determined."', gives = [[
error
  init: 2 initial values are neither fixed nor determined.
what it means
  The equations leave initial values open, and there are fewer independent fixes than free
  values. The candidates are the unknowns that can still move; the recommended ones are chosen
  by pivoting, so that they determine the rest well.
what to do
  Fix them, as in the call that is printed, or give a guess: then the values nearest to it are
  chosen.
source
  help "init"]],
  function(...) return include "explanations"(...) end }
