local w, i = vars "w i"
local u, load = input "u", input "load"
local J, L, R, k = param("J", 0.01), param("L", 0.5), param("R", 1), param("k", 0.1)
return dae { J*der(w) ~ k*i - load, L*der(i) ~ u - R*i - k*w }
