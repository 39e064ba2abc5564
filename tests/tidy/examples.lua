-- What the rules of tidy find, and what they leave alone: each is tried on a few lines before it is used.
local source, findings = require "source", require "findings"
local lengths, statements, citations = require "lengths", require "statements", require "citations"

local function number_found(rule)
  local number = 0
  findings.recorder = function() number = number + 1 end
  rule()
  findings.recorder = nil
  return number
end

local function expect(count, name, rule)
  local found = number_found(rule)
  if found ~= count then
    findings.report("tests/tidy/examples.lua", 1, ("%s: %d findings, expected %d"):format(name, found, count))
  end
end

local function commas(text) return function() statements.check_commas("x", source.code(text, "cpp")) end end
expect(1, "two assignments", commas "void f() { a = 1, b = 2; }")
expect(1, "two calls behind if", commas "void f() { if (x(1, 2)) g(3), h(4); }")
expect(1, "two assignments in a loop", commas "void f() { for (int i = 0; i < n; ++i) a[i] = 1, b = 2; }")
expect(1, "a returned comma", commas "int f() { return a = 1, 2; }")
expect(0, "a declaration", commas "void f() { int a = 1, b = 2; g(a, b); x = {1, 2}; y = h(1, 2); }")
expect(0, "arguments of a template", commas "void f() { g<a, b>(c, d); }")
expect(0, "a loop", commas "void f() { for (int i = 0, j = 1; i < n; ++i, ++j) a = f(i, j); }")

local function casts(text) return function() statements.check_casts("x", source.code(text, "cpp")) end end
expect(1, "a cast in a subscript", casts "a[static_cast<std::size_t>(i)] = 0;")
expect(1, "a cast to Index", casts "a[static_cast<Eigen::Index>(i - f(k))] = 0;")
expect(0, "a cast elsewhere", casts "f(static_cast<std::size_t>(i)); // a[static_cast<std::size_t>(i)]")
expect(0, "an enum, and a factor", casts "a[static_cast<int>(kind)] = b[static_cast<std::size_t>(i) * n + k];")

local function torn(text) return function() statements.check_torn_strings("x", text) end end
expect(1, "a torn literal", torn 'f("a long text that was cut before its last "\n  "word");')
expect(0, "lines of a text", torn 'f("a text of two lines\\n"\n  "the second");\ng(1,\n  "word");')

local function members(body)
  return function() lengths.check_classes("x", source.code("class A {\n" .. body .. "};\n", "cpp")) end
end
expect(0, "25 members", members(("int a%d_ = 0;\n"):rep(25)))
expect(1, "26 members", members(("std::map<int, int> a_;\n"):rep(24) .. "double b_, c_;\n"))
local functions = "int f() const { return a_; }\nvoid g(int a, int b);\n"
expect(0, "functions are no members", members(functions:rep(30)))
expect(1, "251 lines", members(("  // line\n"):rep(249)))

local function unused(...)
  local files = { ... }
  return function()
    local bares, texts = {}, {}
    for i, text in ipairs(files) do
      local file = i == 1 and "src/a/a.hpp" or "src/a/b" .. i .. ".cpp"
      texts[file], bares[file] = text, source.code(text, "cpp")
    end
    statements.check_unused(bares, texts)
  end
end
expect(1, "a function nobody calls", unused("int f(int);\n", "int f(int a) { return a; }\n"))
expect(0, "a function that is called", unused("int f(int);\n", "int f(int a) { return a; }\nint x = f(1);\n"))
expect(0, "a function a macro calls",
  unused("int f(int);\n#define F \\\n  f(1)\n", "int f(int a) { return a; }\n"))

local function outside(text) return function() citations.check_outside("src/x.cpp", text) end end
expect(1, "a document that is not here", outside("// see DESIGN" .. ".md §3\n"))
expect(1, "an equation of an exam", outside("// (exam " .. "(12))\n"))
expect(0, "a book", outside "// Hairer & Wanner, Solving ODEs II, §IV.8; scripts/exam/problem1.lua\n")

local function sections(text) return function() citations.check_sections("src/x.cpp", text) end end
expect(1, "a section that is not there", sections "// docs/derivations.md#nowhere\n")
expect(1, "a page that is not there", sections "// docs/nowhere.md\n")
expect(0, "a section that is there",
  sections "// docs/derivations.md#sigma, docs/derivations.md#partial-fractions.\n")

local function long(file, lines) return function() lengths.check_text(file, ("x\n"):rep(lines)) end end
expect(0, "450 lines", long("src/x.cpp", 450))
expect(1, "451 lines", long("src/x.cpp", 451))
expect(1, "601 lines of a test", long("tests/x.cpp", 601))

local function widths(text) return function() lengths.check_text("x.md", text) end end
expect(1, "111 characters", widths(("a"):rep(111) .. "\n"))
expect(1, "a comment of 111 characters",
  function() lengths.check_text("x.cpp", "  // " .. ("a"):rep(106) .. "\n") end)
expect(0, "a long message in quotes", widths('print "' .. ("a"):rep(150) .. '"\n'))
expect(1, "code around a message", widths(('print(b, "a") '):rep(9) .. "x\n"))
expect(0, "110 characters, and a table", widths(("é"):rep(110) .. "\n|" .. ("a"):rep(200) .. "|\n"))
