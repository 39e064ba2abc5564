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
