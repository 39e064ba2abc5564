-- pendula sweep status runs.db …: what can be done with a sweep without its script.
local usage = [[
usage: pendula sweep status FILE    how many runs and tasks are finished
       pendula sweep collect FILE   take finished shards into the store
       pendula sweep attach FILE    follow a sweep on a cluster until it is finished
       pendula sweep cancel FILE    end its tasks; finished runs are kept, attach continues
]]

local verbs = {}

function verbs.status(cluster, file) print(cluster.status(file)) end

function verbs.collect(cluster, file)
  shards.collect(file)
  print(cluster.status(file))
end

function verbs.attach(cluster, file)
  cluster.follow(file)
  print(cluster.status(file))
end

function verbs.cancel(cluster, file)
  print(("%d jobs cancelled"):format(cluster.cancel(file)))
end

return function(words)
  local verb, file = words[1], words[2]
  if verb == nil or verb == "--help" or verb == "-h" then
    io.write(usage)
    return verb and 0 or 2
  end
  if not verbs[verb] then
    fail(("sweep: unknown command '%s'.%s"):format(verb,
      did_you_mean(verb, { "status", "collect", "attach", "cancel" })))
  end
  if not file then fail(("sweep: the file is missing: pendula sweep %s runs.db"):format(verb)) end
  verbs[verb](include "many/cluster", file)
  return 0
end
