#include "lua/core/foreign_names.hpp"

#include <algorithm>
#include <cctype>
#include <iterator>

namespace pendula::lua {

namespace {

struct Remedy {
  std::string_view names;  ///< separated by blanks
  std::string_view text;
};

constexpr Remedy foreign_globals[] = {
    // values
    {"True TRUE", "write true"},
    {"False FALSE", "write false"},
    {"null", "write nil; the null space of a matrix is null_space(A)"},
    {"None NULL undefined missing", "write nil"},
    {"NaN nan NAN", "write 0/0"},
    {"Inf inf INF infinity Infinity", "write math.huge"},
    {"eps epsilon", "machine epsilon is 2^-52"},
    {"Pi PI π", "write pi"},
    {"e", "Euler's number is exp(1)"},
    // functions of numbers and expressions
    {"ln", "the natural logarithm is log(x)"},
    {"log10 log2", "write log(x)/log(10), of numbers math.log(x, 10)"},
    {"sec csc cot", "write 1/cos(x), 1/sin(x), 1/tan(x)"},
    {"arcsin arccos arctan arctan2 arcsinh arccosh arctanh",
     "write asin, acos, atan, atan2, asinh, acosh, atanh"},
    {"asec acsc acot", "write acos(1/x), asin(1/x), atan(1/x)"},
    {"heaviside Heaviside unitstep unit_step", "a step is ifelse(lt(t, 0), 0, 1)"},
    {"floor ceil fix trunc",
     "numbers have math.floor(x) and math.ceil(x); expressions have no such function"},
    {"mod rem fmod", "the remainder of numbers is a % b; expressions have none"},
    {"factorial gamma nchoosek binomial erf",
     "there is no such function; write it in Lua, or use math and sum"},
    {"conj real imag angle arg",
     "poles are numbers with the fields re and im: p.re, p.im; math.atan(p.im, p.re)"},
    // symbols and models
    {"sym symbols Symbol Symbols", "a variable is x = var \"x\", several are x, y = vars \"x y\""},
    {"syms variables @variables", "write x, y = vars \"x y\""},
    {"parameter parameters Parameter @parameters",
     "write m = param(\"m\", 1), or m, g = params \"m=1 g=9.81\""},
    {"Function", "an unspecified function is f = func \"f\""},
    {"ode ODE odefun ODEProblem model Model ode_system odesys", "a model is dae{ der(x) ~ -x }"},
    {"equation equations Eq", "an equation is written lhs ~ rhs, a model dae{ … }"},
    {"Derivative D Dt Differential ddt", "the derivative by time is der(x) or x.dot"},
    {"Lagrangian euler_lagrange", "write lagrange{ q = q, T = …, V = … }"},
    {"int Integral quad quadgk quadl trapz cumtrapz",
     "write integral(e, x, a, b); an integral along a solution is one more state: der(J) ~ x^2"},
    {"limit Limit taylor Taylor residue",
     "there is no such function; the nearest are in help \"integral\" and help \"apart\""},
    {"substitute replace xreplace", "put values in by subs(e, { x = 2 })"},
    {"grad", "write gradient(e, { x, y })"},
    {"div curl laplacian", "write it by diff: diff(f, x) + diff(g, y)"},
    // solving
    {"ode45 ode23 ode113 odeint solve_ivp lsode rk45 ode15s ode23s ode23t ode15i odesolve lsoda",
     "write sys:integrate{ start = { x = 1 }, to = 10 }"},
    {"deval", "a solution answers by itself: sol(x, 2.5)"},
    {"decic", "consistent initial values: sys:init{ fix = { x = 1 }, guess = { y = 0 } }"},
    {"simulate sim simulateModel integrate integrate_ode",
     "it is a method of models: sys:integrate{ start = { x = 1 }, to = 10 }"},
    {"dsolve", "linear systems have G:solution(x0); else write sys:integrate{ start = { x = 1 }, to = 10 }"},
    {"fsolve fzero root nsolve find_root fsolve_newton",
     "roots of equations are found by newton{ r = { x^2 - 2 }, start = { 1 } }, in closed form by solve(x^2 ~ 2, x)"},
    {"lsqnonlin least_squares curve_fit lsqcurvefit leastsq", "write gauss_newton{ R = …, start = … }"},
    {"fmincon fminsearch fminunc minimize minimise",
     "least squares are gauss_newton{ R = …, start = … }; there is no general minimiser"},
    {"linsolve mldivide lstsq", "a linear system is solve(A, b)"},
    {"collect simplify_expression",
     "write simplify(e); the coefficients of a polynomial are coefficients(e, x)"},
    // matrices and lists
    {"matrix Matrix", "a matrix is mat{{1, 2}, {3, 4}}, a column vec{1, 2}"},
    {"array vector Vector column list np numpy", "a column is vec{1, 2}, a matrix mat{{1, 2}, {3, 4}}"},
    {"identity", "the identity matrix is eye(n)"},
    {"transpose", "the transpose is A.T"},
    {"numel length len size", "the length is #x; of a matrix A.rows and A.cols"},
    {"eigen eigenvalues eigvals eigenvals", "eigenvalues are eig(A)"},
    {"range arange", "equal steps are linspace(from, to, n); a loop is for i = 1, n do … end"},
    {"append push push_back", "write list[#list + 1] = x"},
    {"map filter lambda",
     "write a loop: for i, v in ipairs(list) do … end; a function is function(x) return x^2 end"},
    {"enumerate", "write for i, v in ipairs(list) do … end"},
    {"sum_list cumsum cumprod prod", "write a loop, or sum(…)"},
    {"mean average", "the mean of a list is sum(x)/#x, of the runs of a sweep s:mean(e)"},
    {"std stdev",
     "write norm(x - m*ones(#x))/sqrt(#x - 1) with m = sum(x)/#x; of the runs of a sweep s:std(e)"},
    {"median percentile prctile", "write quantile(x, 0.5)"},
    {"horzcat hcat column_stack", "write hstack(A, B)"},
    {"vertcat vcat cat concatenate row_stack", "write vstack(A, B), side by side hstack(A, B)"},
    {"reshape", "columns are joined by hstack, parts are A:block(1, 2, 1, 3) and v:slice(1, 3)"},
    {"nullspace kernel", "write null_space(A)"},
    {"linalg scipy sympy", "write solve(A, b), inv(A), det(A), eig(A), svd(A), expm(A) without a prefix"},
    {"interp1 interp interpolate griddedInterpolant interpolant CubicSpline table1d",
     "a function through points is f = lookup{ x = { … }, y = { … }, kind = \"pchip\" }, then f(e); samples over "
     "time are an input: inputs = { u = { t = { … }, u = { … } } }"},
    {"polyfit", "a polynomial by least squares is lsq(A, y) with the powers of x as columns of A"},
    {"polyval conv deconv", "polynomials are expressions: p = x^2 + 1, fn({ x }, p)(2), expand(p*q)"},
    {"fft", "write periodogram(u), welch(u), etfe(d)"},
    {"isnan", "write x ~= x"},
    {"isempty", "write #x == 0, of tables next(t) == nil"},
    {"unique", "write a loop: seen[v] = true"},
    {"random randint rand_int", "write rand(), randn(), of whole numbers math.random(1, 6)"},
    {"rng srand", "write seed(1)"},
    {"eval exec evalin", "write load(text)()"},
    {"zip", "write for i = 1, #a do … a[i], b[i] … end"},
    {"dict", "a table with names is { a = 1, b = 2 }"},
    {"sort sorted", "write table.sort(list)"},
    {"round", "write math.floor(x + 0.5)"},
    {"where", "a choice between expressions is ifelse(lt(x, 0), a, b)"},
    {"vpa N evalf", "the number of an expression is evaluate(e), with values evaluate(e, { x = 2 })"},
    {"lambdify matlabFunction build_function", "a compiled function is fn({ x, y }, e)"},
    {"format", "write (\"%.10g\"):format(x)"},
    {"time", "the time is t; at the prompt, time f(x) says how long f takes"},
    // events, Modelica, ModelingToolkit
    {"when reinit pre edge change",
     "write integrate{ …, events = { { when = x, direction = -1, reset = { [v] = -0.9*v } } } }"},
    {"noEvent smooth", "write the expression alone; borders of ifelse and abs are found without it"},
    {"homotopy",
     "where the search for a start begins is guess: sys:init{ fix = { x = 1 }, guess = { z = 0 } }"},
    {"Real Integer Variable", "a variable is x = var \"x\", a constant m = param(\"m\", 1)"},
    {"structural_simplify mtkcompile dae_index_lowering", "the index is lowered by sys:reduce()"},
    {"remake", "other values are sys:with{ m = 2 }, or integrate{ …, params = { m = 2 } }"},
    {"delay dde23 ddesd DDEProblem ddeint jitcdde transport_delay spatialDistribution",
     "equations have no delays; of transfer functions a delay is exp(-T*s), in models of parts approximately "
     "components.signals.delay{ T = 1 }"},
    {"Tsit5 Vern7 Vern9 Rodas4 Rodas5 Rodas5P Rosenbrock23 TRBDF2 CVODE_BDF IDA DP5 RK4",
     "a method is an option: integrate{ …, method = \"tsit5\" }; their names are printed by methods()"},
    {"radau radau5 bdf rodas gauss dopri5 tsit5 dop853 verner87 rkc",
     "a method is named by a text: method = \"radau\""},
    {"ode_solve rk4 euler heun",
     "write sys:integrate{ start = { x = 1 }, to = 10, method = rk.rk4, dt = 0.01 }"},
    {"linspace_", "write linspace(from, to, n)"},
    // printing, files, session
    {"disp println display puts echo", "write print(x)"},
    {"printf fprintf sprintf", "write print((\"%.3f\"):format(x))"},
    {"clear clearvars clear_all workspace", "reset() forgets the variables, x = nil one of them"},
    {"clc cls", "Ctrl-L clears the screen"},
    {"close closeall close_all", "figures are values: nothing has to be closed"},
    {"quit exit", "write os.exit(), or press Ctrl-D"},
    {"doc man lookfor", "write help \"word\" or apropos \"word\""},
    {"import include using from source",
     "a file is run by dofile \"file.lua\", a module read by require \"file\""},
    {"open fopen readmatrix csvread read_csv readtable loadtxt",
     "data are read by iddata.read(\"file.csv\", { y = \"…\" })"},
    {"tic toc timeit", "write t0 = os.clock() … print(os.clock() - t0)"},
    {"str string_of", "write tostring(x)"},
    {"int float double", "write math.tointeger(x) or tonumber(x), of an expression evaluate(e)"},
    {"try except catch", "write ok, message = pcall(function() … end)"},
    {"elif elsif", "write elseif"},
    {"switch case", "write if … then … elseif … then … end"},
    {"def fun fn_def", "a function is function f(x) return x^2 end"},
    {"var_dump typeof class", "write type(x); help(x) explains a value"},
    // pictures
    {"figure_ plt pyplot subplot hold axis xlabel ylabel zlabel legend grid title xlim ylim",
     "these are options: plot(x, y, { title = \"…\", xlabel = \"…\", labels = { … } })"},
    {"savefig saveas print_figure exportgraphics", "write plot(x, y):save \"file.svg\""},
    // linear systems and identification
    {"TransferFunction", "write tf({1}, {1, 1})"},
    {"s", "the variable of transfer functions is s = tf \"s\""},
    {"routh Routh routh_hurwitz hurwitz", "write G:stability(), with symbols the conditions of Routh"},
    {"evalfr freqs freqz", "the value at a point is G(s), at jω G({ 0, w }), a curve G:freqresp()"},
    {"bandwidth", "where the gain has fallen by 3 dB is read from bode(G)"},
    {"pid PID", "with s = tf \"s\" a controller is kp + ki/s + kd*s/(0.01*s + 1)"},
    {"StateSpace", "write ss(A, B, C, D)"},
    {"zeros_of poles_of pole zero isstable", "write G:poles() or G:zeros()"},
    {"ssdata", "write g = G:ss(), then g.A, g.B, g.C, g.D"},
    {"tfdata", "write G:tf().num and G:tf().den"},
    {"ssest", "write n4sid(d, 2), refined by pem(d, n4sid(d, 2))"},
    {"resid", "write mod:validate(d)"},
    {"present", "write print(mod)"},
    {"polydata", "write mod.A, mod.B"},
    {"fplot ezplot", "the graph of an expression or a function is plot(sin(x), { -3, 3 })"},
    {"scatter scatter3 scatterplot", "points are plot(x, y, { style = \"points\" })"},
    {"stepinfo", "step(G) prints them; r = step(G) has r.rise_time, r.overshoot, r.settling_time"},
};

constexpr Remedy model_members[] = {
    {"simulate solve sim run ode45", "write sys:integrate{ start = { x = 1 }, to = 10 }"},
    {"states x state", "the states are sys.differential"},
    {"ode odeint simulate_", "write sys:integrate{ start = { x = 1 }, to = 10 }"},
    {"start initial initial_state init_state x0 initialize", "a start is sys:init{ fix = { x = 1 } }"},
    {"print show display summary disp", "write print(sys)"},
    {"index_reduction lower_index dae_index pantelides", "write sys:reduce()"},
    {"mass mass_matrix Mass", "of a lagrange model it is sys.M"},
    {"jac J", "the Jacobian of expressions is jacobian(f, x); the linear model sys:linearize{ … }"},
    {"params", "the parameters are sys.parameters; other values: sys:with{ m = 2 }"},
    {"linearise linearization", "write sys:linearize{ … }"},
    {"subs set set_parameter update", "other parameter values are sys:with{ m = 2 }"},
    {"jacobian", "the Jacobian of expressions is jacobian(f, x); the linear model sys:linearize{ … }"},
    {"plot", "write plot(sys:integrate{ start = { x = 1 }, to = 10 }, { x })"},
};

constexpr Remedy solution_members[] = {
    {"table dataframe to_csv", "sol:csv \"run.csv\" writes a table; sol(x) is a column of it"},
    {"y Y u states", "the values of an expression are sol(x), at time t sol(x, t)"},
    {"time times T", "the times are sol.t"},
    {"save export write to_file dump",
     "sol:csv \"run.csv\" writes its values, save(\"run.pend\", sol) all of it"},
    {"success message retcode ret_code flag", "write sol.status"},
    {"value values at interp interpolate eval get", "write sol(x, t)"},
    {"steps nsteps nfev naccept nfcn destats", "write sol:stats()"},
    {"len length size n", "the number of saved points is #sol.t"},
    {"last", "the values at the end are sol:final(x)"},
};

constexpr Remedy matrix_members[] = {
    {"t transpose Transpose H", "the transpose is A.T"},
    {"get at", "an entry is A(1, 2), of a column v[1]"},
    {"inv inverse I", "the inverse is inv(A)"},
    {"det", "the determinant is det(A)"},
    {"shape size", "write A.rows and A.cols"},
    {"length n len", "write #A"},
    {"dot", "the derivative of a column of variables is der(q); a product is a.T*b"},
    {"sum", "write sum(A)"},
    {"max min abs", "write max(A), min(A), abs(A)"},
    {"mean average avg", "the mean of a column is sum(y)/#y"},
};

constexpr Remedy form_members[] = {
    {"b rhs right", "the right side is form.c"},
    {"x q z", "the unknowns are form.unknowns, their values form:solve()"},
    {"M matrix", "the matrix is form.A"},
};

constexpr Remedy sweep_members[] = {
    {"csv save", "each run is a solution: runs[i]:csv \"run.csv\""},
};

constexpr Remedy expr_members[] = {
    {"subs replace evalf eval evaluate value subs_",
     "put values in by subs(e, { x = 2 }); the number is evaluate(e, { x = 2 })"},
    {"diff derivative d", "the partial derivative is diff(e, x), the derivative by time der(e)"},
    {"dt prime", "the derivative by time is x.dot or der(x)"},
    {"simplify expand factor", "write simplify(e)"},
};

constexpr Remedy rosenbrock_members[] = {
    {"verify conditions",
     "its orders, by the order conditions, are in method:report(), and its errors on a model are shown by "
     "converge(sys, { …, methods = { method }, rtol = { 1e-4, 1e-6 } })"},
};

constexpr Remedy tableau_members[] = {
    {"order_conditions", "write tab:conditions(5)"},
    {"stability_function stability_interval stability_region R amplification_factor",
     "write tab:stability(), with the limits on both axes"},
    {"s", "the number of stages is tab.stages"},
    {"bh b_hat bs bstar btilde b2", "the embedded weights are tab.bhat"},
    {"plot_stability", "write tab:plot()"},
};

constexpr Remedy data_members[] = {
    {"InputData Inputs inputs", "the inputs are d.u"},
    {"OutputData Outputs outputs", "the outputs are d.y"},
    {"SamplingInstants time", "the times are d.t"},
};

constexpr Remedy lti_members[] = {
    {"stable isstable", "write G:is_stable(), or G:stability() with the reason"},
    {"eig pole", "write G:poles()"},
    {"zero", "write G:zeros()"},
    {"stepinfo", "G:step() prints them; r = G:step() has r.rise_time, r.overshoot, r.settling_time"},
    {"at evalfr evaluate value", "the value at a point is G(s), at jω G({ 0, w })"},
    {"bandwidth", "where the gain has fallen by 3 dB is read from G:bode()"},
    {"freq frequency_response", "write G:freqresp()"},
};
constexpr Remedy delay_members[] = {
    {"poles zeros damp stability is_stable rlocus",
     "there are infinitely many poles; margin(G) says whether the closed loop is stable, pade(G, 4) is a system with "
     "poles near the dominant ones"},
    {"ss tf zpk norm gram minreal",
     "write pade(G, 4), a system without delay that is like it at low frequencies"},
};
constexpr Remedy idmodel_members[] = {
    {"Report report summary", "write print(mod)"},
    {"a", "the coefficients are mod.A, mod.B"},
    {"sim", "write mod:simulate(d)"},
};

/// Options of other programs and their equivalents here.
struct OptionRemedy {
  std::string_view names, option, text;
};

constexpr OptionRemedy foreign_options[] = {
    {"tspan t_span timespan tstop stopTime StopTime t_end tend tf", "to",
     "to = 10 is the end, from = 0 the beginning"},
    {"x0 y0 u0 initial initial_values", "start", "write start = { x = 1 }"},
    {"solver Solver alg algorithm integrator", "method", "write method = \"radau\""},
    {"RelTol rel_tol tolerance tol", "rtol", "write rtol = 1e-6"},
    {"samples trials n N num_samples ensemble", "runs", "write runs = 1000"},
    {"AbsTol abs_tol", "atol", "write atol = 1e-9"},
    {"t_eval saveat tout", "times", "write times = linspace(0, 10, 101)"},
    {"step h stepsize", "dt", "a fixed step is dt = 0.01, the largest of chosen ones dtmax = 0.1"},
    {"MaxStep max_step dt_max hmax h_max", "dtmax", "write dtmax = 0.1"},
    {"max_iterations max_iter maxiter MaxIter MaxIterations iterations", "max", "write max = 50"},
    {"damping relaxation step_size stepsize", "alpha", "write alpha = 0.5"},
    {"eps epsilon accuracy tolerance", "tol", "write tol = 1e-12"},
    {"f F fun function residual residuals equations", "r", "write r = { x^2 - 2 }"},
    {"jac J Jacobian", "jacobian", "write jacobian = \"exact\""},
    {"p parameters Parameters", "params", "write params = { m = 2 }"},
    {"callback callbacks Events", "events", "write events = { { when = x, direction = -1 } }"},
    {"linewidth lw LineWidth", "width", "write width = 2"},
    {"linestyle ls LineStyle", "dash", "write dash = \"dashed\""},
    {"c", "colour", "write colour = \"red\""},
    {"label", "labels", "write labels = { \"a\", \"b\" }"},
    {"loc location Location", "legend", "write legend = \"top left\""},
    {"xscale", "xlog", "write xlog = true"},
    {"yscale", "ylog", "write ylog = true"},
    {"figsize", "size", "write size = { 800, 500 }, in pixels"},
    {"orders", "na", "write na = 2, nb = 2, nk = 1"},
};

bool among(std::string_view names, std::string_view name) {
  while (!names.empty()) {
    const std::size_t end = std::min(names.find(' '), names.size());
    if (names.substr(0, end) == name) return true;
    names.remove_prefix(std::min(end + 1, names.size()));
  }
  return false;
}

std::string remedy_in(const Remedy* first, const Remedy* last, std::string_view name) {
  for (; first != last; ++first)
    if (among(first->names, name)) return std::string(first->text);
  return "";
}

}  // namespace

std::string remedy_for_name(std::string_view name) {
  return remedy_in(std::begin(foreign_globals), std::end(foreign_globals), name);
}

std::string remedy_for_member(std::string_view type, std::string_view name) {
  if (type == "model") return remedy_in(std::begin(model_members), std::end(model_members), name);
  if (type == "solution") return remedy_in(std::begin(solution_members), std::end(solution_members), name);
  if (type == "matrix") return remedy_in(std::begin(matrix_members), std::end(matrix_members), name);
  if (type == "matrix_form") return remedy_in(std::begin(form_members), std::end(form_members), name);
  if (type == "sweep") return remedy_in(std::begin(sweep_members), std::end(sweep_members), name);
  if (type == "rosenbrock")
    return remedy_in(std::begin(rosenbrock_members), std::end(rosenbrock_members), name);
  if (type == "tableau") return remedy_in(std::begin(tableau_members), std::end(tableau_members), name);
  if (type == "iddata") return remedy_in(std::begin(data_members), std::end(data_members), name);
  if (type == "idmodel") return remedy_in(std::begin(idmodel_members), std::end(idmodel_members), name);
  if (type == "lti") return remedy_in(std::begin(lti_members), std::end(lti_members), name);
  if (type == "delay system") return remedy_in(std::begin(delay_members), std::end(delay_members), name);
  if (type == "expr") return remedy_in(std::begin(expr_members), std::end(expr_members), name);
  return "";
}

std::string remedy_for_option(std::string_view name, const std::vector<std::string>& known) {
  for (const OptionRemedy& remedy : foreign_options)
    if (among(remedy.names, name) && std::find(known.begin(), known.end(), remedy.option) != known.end())
      return std::string(remedy.text);
  return "";
}

std::string method_like(std::string_view name) {
  static constexpr Remedy methods[] = {
      {"ode45 rk45 dp5 dorpi dopri54 dormand_prince rkdp ode5", "dopri5"},
      {"ode23 rk23 bs3 bs23", "bogacki_shampine"},
      {"ode113 vern9 dop8 dopri8 dopri853 ode78 ode89", "dop853"},
      {"ode15s ode15i lsoda vode cvode ida dassl daspk fbdf qndf ndf gear dae", "bdf"},
      {"ode23s ode23t ode23tb rodas4 rodas5 rodas5p rosenbrock rosenbrock23", "rodas"},
      {"bdf1 bdf2 bdf3 bdf4 bdf5", "bdf"},
      {"radau5 radauiia radau_iia radauiia5", "radau"},
      {"tsitouras tsitouras5", "tsit5"},
      {"runge_kutta rungekutta rk classical rk_4 kutta4 runge_kutta4", "rk4"},
      {"euler_forward forward_euler explicit_euler euler_explicit", "euler"},
      {"backward_euler euler_backward euler_implicit", "implicit_euler"},
      {"crank_nicolson cn trapezoidal trapezoidal_rule", "trapezoid"},
      {"default automatic", "auto"},
  };
  std::string lower(name);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return remedy_in(std::begin(methods), std::end(methods), lower);
}

}  // namespace pendula::lua
