--- # Exam problem 4: Newton's method
--- When do full steps converge, and what does ‖x₊ - x⋆‖ ≤ c ‖x - x⋆‖² mean? The iteration (51):
--- ∂r/∂x Δx + r = 0, x ← x + α Δx. In (52) x⋆ is a root, r(x⋆) = 0 (missing in the print); (66) needs
--- α > 0, since α = 0 never moves.
--
--   pendula scripts/exam/problem4.lua              the numbers
--   pendula scripts/exam/problem4.lua show         and the pictures
local show = arg and arg[1] == "show"

x, y = vars "x y"
r = { x*y - 2, x^4/4 + y^3/3 - 1 }

print "4(a)  What is required for convergence with α = 1?"
print "A start in a neighbourhood of a solution, small where r is very nonlinear, in which ∂r/∂x is regular throughout."
print "\nNear a solution: full steps converge"
k = newton { r = r, x = {x, y}, start = {-1, -1} }
print(k)
expect(k.converged):is_true()

print "\nThe Jacobian must be regular at every iterate: from (0, 0) there is no step"
print(newton { r = r, x = {x, y}, start = {0, 0} })

print "\nToo far away, or r too nonlinear: full steps of x³ - 2x + 2 = 0 cycle between 0 and 1,"
print(newton { r = x^3 - 2*x + 2, start = {0} })
print "\nthose of arctan x = 0 diverge from every start with |x| > 1.39,"
print(newton { r = atan(x), start = {1.4} }.verdict)
print "\nand a line search brings them back."
back = newton { r = atan(x), start = {1.4}, alpha = "line search" }
print(back.verdict)
expect(back.x):near(0, 1e-12)

print "\nThe neighbourhood of each root of z³ = 1, seen from 101 × 101 starts z = x + iy"
cubic = newton { r = { x^3 - 3*x*y^2 - 1, 3*x^2*y - y^3 }, x = {x, y}, start = {1, 1} }
basins = cubic:basins { x = {-1.5, 1.5}, y = {-1.5, 1.5}, n = 101 }
print(basins)
if show then basins:plot():show() end

print "\n4(b)  When is ‖x₊ - x⋆‖ ≤ c ‖x - x⋆‖²?"
print "With exact Jacobians, full steps α = 1, near a solution at which ∂r/∂x is regular. One counterexample for each:"
print "\nExact Jacobian, α = 1, regular root: the column ‖e₊‖/‖e‖² above settles, the number of digits doubles."
errors = k.errors
for i = 4, 6 do print(("  iterate %d: %4.1f correct digits"):format(i - 1, -math.log(errors[i], 10))) end
if show then plot(k):show() end

print "\nα = 0.5: every step keeps half of the error"
half = newton { r = r, x = {x, y}, start = {-1, -1}, alpha = 0.5 }
print(half)
expect(half.rate):near(0.5, 1e-3)

print "\nThe Jacobian of the start, kept in every step"
frozen = newton { r = r, x = {x, y}, start = {-1.5, -1.3}, jacobian = "frozen" }
print(frozen)
expect(frozen.rate):near(frozen.predicted_rate, 0.02)

print "\nAn approximate Jacobian: difference quotients with a step of 5 %, and with the usual √ε"
print(newton { r = r, x = {x, y}, start = {-1.5, -1.3}, jacobian = "finite difference", h = 0.05 })
print(newton { r = r, x = {x, y}, start = {-1.5, -1.3}, jacobian = "finite difference" })

print "\nA singular root: the line x + y = 2 touches the circle x² + y² = 2 at (1, 1)"
touching = newton { r = { x^2 + y^2 - 2, x + y - 2 }, x = {x, y}, start = {3, 0} }
print(touching)
expect(touching.rate):near(0.5, 1e-3)

print "\nFaster than quadratic where c = 0: the second derivative of sin x vanishes at its root"
print(newton { r = sin(x), start = {0.5} }.verdict)

print "\nLinear equations: one full step"
print(newton { r = { 2*x + y - 1, x - y }, x = {x, y}, start = {5, -3} })
