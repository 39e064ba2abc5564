--- speaks(sol) -> whether a run says that its solution may be wrong: it has not finished, its errors add up
--- to many tolerances, or errors have decided where it leads.
return function(sol)
  return sol.status ~= "finished" or sol:stats().not_unique ~= "" or
    tostring(sol):find("sol:check() estimates", 1, true) ~= nil
end
