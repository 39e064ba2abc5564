// Block Hankel matrices of data, and their triangular factors.
#pragma once

#include "sysid/data/iddata.hpp"

namespace pendula::sysid {

/// The triangular factor R of the matrix with one row [U_f W_p Y_f] per window: future inputs u(t) …
/// u(t+i-1), past u(t-1) y(t-1) … u(t-i) y(t-i), future outputs y(t) … y(t+i-1).
struct Hankel {
  Index i = 0, inputs = 0, outputs = 0;
  Mat R;                        ///< of all windows
  Mat shorter;                  ///< of all windows but the last of each experiment
  Index windows = 0, ends = 0;  ///< how many windows, and experiments that have some

  Index future() const { return inputs * i; }  ///< columns of U_f
  Index past() const { return (inputs + outputs) * i; }
  Index y() const { return outputs * i; }
  Mat R12() const { return R.block(0, future(), future(), past()); }
  Mat R22() const { return R.block(future(), future(), past(), past()); }
  Mat R23() const { return R.block(future(), future() + past(), past(), y()); }
  Mat R33() const { return R.bottomRightCorner(y(), y()); }
  double y_size() const { return R.rightCols(y()).norm(); }  ///< ‖Y_f‖
};

/// By the Cholesky factor of the moments, which follow from each other along the diagonals
/// (cost N·2i·(m+p)²), where this keeps ten digits; else by orthogonal transformations of
/// the windows (cost N·(2i(m+p))²).
/// see  Sima, Sima & Van Huffel, J. Comput. Appl. Math. 170(2), 2004, §3
Hankel hankel(const IdData& d, Index i);

}  // namespace pendula::sysid
