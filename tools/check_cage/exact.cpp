#include "tools/check_cage/exact.h"

#include <gmpxx.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace check {
namespace {

// n numbers as integers: all times one power of two.
template <std::size_t n>
std::array<mpz_class, n> integers(const std::array<double, n>& numbers) {
  std::array<std::int64_t, n> mantissa;
  std::array<int, n> exponent{};
  int lowest = std::numeric_limits<int>::max();
  for (std::size_t i = 0; i < n; ++i) {
    mantissa[i] = std::int64_t(std::ldexp(std::frexp(numbers[i], &exponent[i]), 53));
    if (mantissa[i] != 0) lowest = std::min(lowest, exponent[i]);
  }
  std::array<mpz_class, n> out;
  for (std::size_t i = 0; i < n; ++i)
    if (mantissa[i] != 0) out[i] = mpz_class(long(mantissa[i])) << unsigned(exponent[i] - lowest);
  return out;
}

int sign(double x) { return (x > 0) - (x < 0); }

// The sign of det(b − a, c − a) of the coordinates u and v.
int turn(const Point& a, const Point& b, const Point& c, std::size_t u, std::size_t v) {
  const double left = (b[u] - a[u]) * (c[v] - a[v]), right = (b[v] - a[v]) * (c[u] - a[u]);
  // Three roundings a product, one of the difference: below 4 units, of 2^-53, of the sum of sizes (plus
  // underflow).
  constexpr double bound = 0x1p-50, underflow = 1e-300;
  if (std::abs(left - right) > bound * (std::abs(left) + std::abs(right)) + underflow)
    return sign(left - right);
  const auto z = integers<6>({a[u], a[v], b[u], b[v], c[u], c[v]});
  return sgn((z[2] - z[0]) * (z[5] - z[1]) - (z[3] - z[1]) * (z[4] - z[0]));
}

// Closed, in the projection to u and v.
bool segments_meet(const Point& p, const Point& q, const Point& a, const Point& b, std::size_t u,
                   std::size_t v) {
  const int pqa = turn(p, q, a, u, v), pqb = turn(p, q, b, u, v), abp = turn(a, b, p, u, v),
            abq = turn(a, b, q, u, v);
  if (pqa * pqb > 0 || abp * abq > 0) return false;
  if (pqa != 0 || pqb != 0 || abp != 0 || abq != 0) return true;
  const auto apart = [&](std::size_t k) {
    return std::max(p[k], q[k]) < std::min(a[k], b[k]) || std::max(a[k], b[k]) < std::min(p[k], q[k]);
  };
  return !apart(u) && !apart(v);
}

bool point_in_triangle(const Point& p, const Corners& t, std::size_t u, std::size_t v) {
  const int a = turn(t[0], t[1], p, u, v), b = turn(t[1], t[2], p, u, v), c = turn(t[2], t[0], p, u, v);
  if ((a > 0 && b > 0 && c > 0) || (a < 0 && b < 0 && c < 0)) return true;
  return segments_meet(p, p, t[0], t[1], u, v) || segments_meet(p, p, t[1], t[2], u, v) ||
         segments_meet(p, p, t[2], t[0], u, v);
}

// What holds in all three projections holds in the one, at least, that is injective on the plane of the
// figure.
bool in_all_projections(const auto& holds) { return holds(0, 1) && holds(1, 2) && holds(2, 0); }

bool coplanar_meet(const Point& p, const Point& q, const Corners& t) {
  if (in_all_projections([&](std::size_t u, std::size_t v) { return point_in_triangle(p, t, u, v); }))
    return true;
  for (std::size_t k = 0; k < 3; ++k) {
    const Point &a = t[k], &b = t[(k + 1) % 3];
    if (orientation(p, q, a, b) == 0 &&
        in_all_projections([&](std::size_t u, std::size_t v) { return segments_meet(p, q, a, b, u, v); }))
      return true;
  }
  return false;
}

}  // namespace

int orientation(const Point& a, const Point& b, const Point& c, const Point& d) {
  if (a == b || a == c || a == d || b == c || b == d || c == d) return 0;
  std::array<double, 9> m;
  for (std::size_t k = 0; k < 3; ++k) m[k] = b[k] - a[k], m[3 + k] = c[k] - a[k], m[6 + k] = d[k] - a[k];
  const double yz = m[4] * m[8], zy = m[5] * m[7], zx = m[5] * m[6], xz = m[3] * m[8], xy = m[3] * m[7],
               yx = m[4] * m[6];
  const double value = m[0] * (yz - zy) + m[1] * (zx - xz) + m[2] * (xy - yx);
  const double size = std::abs(m[0]) * (std::abs(yz) + std::abs(zy)) +
                      std::abs(m[1]) * (std::abs(zx) + std::abs(xz)) +
                      std::abs(m[2]) * (std::abs(xy) + std::abs(yx));
  // Eight roundings on the way of any product to the sum: below 8 units of 2^-53, doubled to be sure.
  constexpr double bound = 0x1p-49, underflow = 1e-290;
  if (std::abs(value) > bound * size + underflow) return sign(value);
  const auto z = integers<12>({a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2], d[0], d[1], d[2]});
  std::array<mpz_class, 9> n;
  for (std::size_t i = 0; i < 9; ++i) n[i] = z[3 + i] - z[i % 3];
  return sgn(n[0] * (n[4] * n[8] - n[5] * n[7]) + n[1] * (n[5] * n[6] - n[3] * n[8]) +
             n[2] * (n[3] * n[7] - n[4] * n[6]));
}

Meeting meet(const Point& p, const Point& q, const Corners& t) {
  const int above = orientation(t[0], t[1], t[2], p), below = orientation(t[0], t[1], t[2], q);
  if (above * below > 0) return Meeting::none;
  if (above == 0 && below == 0) return coplanar_meet(p, q, t) ? Meeting::touching : Meeting::none;
  const int a = orientation(p, q, t[0], t[1]), b = orientation(p, q, t[1], t[2]),
            c = orientation(p, q, t[2], t[0]);
  const bool hit = (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
  if (!hit) return Meeting::none;
  return above * below < 0 && a * b * c != 0 ? Meeting::crossing : Meeting::touching;
}

Meeting meet(const Corners& s, const Corners& t) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (std::max({s[0][k], s[1][k], s[2][k]}) < std::min({t[0][k], t[1][k], t[2][k]})) return Meeting::none;
    if (std::max({t[0][k], t[1][k], t[2][k]}) < std::min({s[0][k], s[1][k], s[2][k]})) return Meeting::none;
  }
  Meeting found = Meeting::none;
  for (std::size_t k = 0; k < 3 && found != Meeting::crossing; ++k)
    found = std::max({found, meet(s[k], s[(k + 1) % 3], t), meet(t[k], t[(k + 1) % 3], s)});
  return found;
}

}  // namespace check
