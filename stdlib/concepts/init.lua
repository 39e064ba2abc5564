-- Pages about concepts: what a word means here, an example that is a test, and where to go on. help
-- "stiffness"
-- finds a page by its name or by one of its words; the pages are read when help is first asked.
--
--   concept { name = "index", words = "differentiation index", see = "model:index", text = …, example = … }

concepts = {}

function concept(page)
  for _, key in ipairs { "name", "words", "see", "text", "example" } do
    if type(page[key]) ~= "string" then error("a concept without " .. key) end
  end
  concepts[#concepts + 1] = { name = page.name, sig = page.name, text = prose(page.text), module = "topics",
    title = "Words explained", example = block("\n" .. page.example:gsub("^\n", "")),
    gives = page.gives and block("\n" .. page.gives:gsub("^\n", "")) or "",
    words = page.words, see = page.see,
    is_concept = true }
end

include "concepts/models"
include "concepts/integration"
include "concepts/data"
include "concepts/tasks"

return concepts
