-- Small additions to models, written in Lua.

doc { name = "matrix_form:solve", module = "mech", sig = "form:solve() -> column",
  text = "The unknowns [q″; z] of the matrix form, solved symbolically.",
  example = [[
    q = var "q"
    return lagrange{ q = q, T = q.dot^2, V = 3*q^2 }.matrix_form:solve()]], gives = "-3 q",
  function(form)
    if object_type(form) ~= "matrix_form" then
      fail "solve: expected a matrix form, as in sys.matrix_form:solve()"
    end
    return solve(form.A, form.c)
  end }
