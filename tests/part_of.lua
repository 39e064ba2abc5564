-- The long lists of the tests in full where PENDULA_LONG is set (./dev long); otherwise
-- one of so many combinations.
local all = os.getenv "PENDULA_LONG"

--- part_of(n) -> a function that is true the first time and then every n-th time. Asked in the innermost of
--- nested loops, n a prime that divides the length of no list: every value of each list meets the others.
return function(n)
  local count = 0
  return function()
    count = count + 1
    return all or count % n == 1
  end
end
