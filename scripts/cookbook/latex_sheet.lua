-- A sheet of mathematics: the equations of a cart with a pendulum, ready for LaTeX.
q = var("q", 2)
M, m, l, g = params "M m l g"
cart, bob = vec(q[1], 0), vec(q[1] + l*sin(q[2]), -l*cos(q[2]))
sys = lagrange { q = q, T = M*norm(der(cart))^2/2 + m*norm(der(bob))^2/2, V = m*g*bob[2] }
print(simplify(sys.M(1, 1)), simplify(sys.M(1, 2)))
print((sys:latex():match "[^\n]*"))
save("sheet.tex", { "The equations of motion:", sys, "Their derivation:", sys:trace() })
lines = 0
for line in io.lines "sheet.tex" do lines = lines + 1 end
print("a document of " .. (lines > 20 and "more than 20" or lines) .. " lines")
