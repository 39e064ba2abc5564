-- print of several values: what has several lines stands under its first line, or on lines of its own.

local function printed(script)
  local file = os.tmpname()
  local out = assert(io.open(file, "w"))
  out:write(script)
  out:close()
  local run = assert(io.popen(("'%s' '%s' 2>&1"):format(os.getenv "PENDULA" or "pendula", file)))
  local text = run:read "a"
  run:close()
  os.remove(file)
  return text
end

test("matrices beside texts and matrices", function()
  local A = "A = mat { { 1, 2 }, { 3, 4 } } "
  expect(printed(A .. 'print("A =", A)')):equals "A = ⎡1  2⎤\n    ⎣3  4⎦\n"
  expect(printed(A .. "print(A, A)")):equals "⎡1  2⎤\n⎣3  4⎦\n⎡1  2⎤\n⎣3  4⎦\n"
  expect(printed(A .. 'print(("x"):rep(50), A)')):equals(("x"):rep(50) .. "\n⎡1  2⎤\n⎣3  4⎦\n")
  expect(printed(A .. 'print(A, 3)')):equals "⎡1  2⎤\n⎣3  4⎦\n3\n"
end)

test("everything else in one line, with blanks", function()
  expect(printed 'print(1, "x", nil, true, vec(1, 2), { 1, 2 })'):equals "1 x nil true (1, 2) {1, 2}\n"
  expect(printed 'print() print("", 1) print("a\\nb", 2)'):equals "\n 1\na\nb 2\n"
end)

test("records: a missing entry stays blank, long expressions are cut, other lists stay lists", function()
  expect(printed 'print { { a = 1, b = 2, c = 3 }, { a = 4, c = 5 } }'):equals "a  b  c\n1  2  3\n4     5\n"
  local wide = printed 'x, y = vars "xxxxxxxxxx y" print { { t = 1, when = (x + y)^2*sin(x)*exp(x*y) } }'
  expect(wide:find "^t  when" ~= nil and wide:find "…" ~= nil):is_true()
  expect(printed 'print { { a = 1 }, { b = 2 } }'):equals "{{a = 1},\n {b = 2}}\n"
end)

test("a library lists what is in it", function()
  local text = printed "print(components)"
  expect(text:find "^components: electrical, hydraulic," ~= nil):is_true()
  expect(text:find "help%(components%) explains them" ~= nil):is_true()
  expect(printed "print(rk)":find "dopri5" ~= nil):is_true()
  for line in printed "print(problems)":gmatch "[^\n]+" do expect(#line <= 80):is_true() end
end)
