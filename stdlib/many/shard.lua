-- pendula shard runs.db.d/17 …: makes the runs of shards.
local usage = [[
usage: pendula shard [-j processes] FOLDER/NUMBER...

Makes the runs of shards that sweep{ …, store = "runs.db", shards = 64 } wrote into the folder runs.db.d, for
any scheduler. Results go into files beside them; `pendula sweep collect runs.db` takes them into the store. A
shard that is finished, or that another process finishes first, is left alone.

  parallel --sshlogin node1,node2 pendula shard {} ::: $PWD/runs.db.d/{1..64}
]]

return function(words)
  local list, workers, at = {}, nil, 1
  while words[at] do
    local word = words[at]
    if word == "--help" or word == "-h" then
      io.write(usage)
      return 0
    elseif word == "-j" then
      at = at + 1
      workers = math.tointeger(tonumber(words[at]))
        or fail "shard: -j needs the number of processes: pendula shard -j 4 …"
    elseif word:find "^%-" then
      fail(("shard: unknown option '%s'."):format(word))
    else
      list[#list + 1] = word
    end
    at = at + 1
  end
  if #list == 0 then fail "shard: which? pendula shard runs.db.d/17" end
  for _, path in ipairs(list) do print(path .. ": " .. shards.run(path, workers)) end
  return 0
end
