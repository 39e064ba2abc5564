-- Large values that Lua holds by small handles go when the process has grown, however often that happens.

local function resident()                                      -- MB
  for line in io.lines "/proc/self/status" do
    local kilobytes = line:match "^VmRSS:%s+(%d+)"
    if kilobytes then return tonumber(kilobytes)/1024 end
  end
end

test("a loop over samples, each of which copies the record", function()
  local y = {}
  for i = 1, 60000 do y[i] = i end
  local d, sum, most = iddata { y = y, Ts = 1 }, 0, 0
  for i = 1, 6000 do
    sum = sum + d.y(i, 1)
    if i % 100 == 0 then most = math.max(most, resident()) end
  end
  expect(sum):equals(6000*6001/2)
  expect(most < 600):is_true()
end)
