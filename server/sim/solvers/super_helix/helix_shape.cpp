#include "server/sim/solvers/super_helix/helix_shape.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "server/sim/directions.h"

namespace strandcast {
namespace {

constexpr double kTinyTurnRad = 1e-10;
constexpr double kMinEdgeM = 1e-5;
constexpr double kSmallAngle = 1e-4;
// Abscissa of Gauss's rule with two points, about the middle of an edge, in edges.
constexpr double kGaussPoint = 0.28867513459481287;

// Newton's method: largest turn of an element per step, end of the search, halvings of a step.
constexpr double kMaxPieceTurnRad = 1.0;
constexpr double kEndTurnRad = 1e-9;
constexpr int kMostHalvings = 10;
// Of the stiffest curvature's inertia, what every one has at least in the matrix.
constexpr double kLeastShare = 1e-7;
// Fitting a line: weight of the curvatures found first against the points.
constexpr double kFitShare = 1e-7;
constexpr uint32_t kFitSteps = 30;

const glm::dvec3 kAlongPiece(0.0, 0.0, 1.0);

/// A helical piece seen from the frame at its start.
struct Piece {
  glm::dmat3 turn{1.0};
  glm::dvec3 way_m{0.0};
};

/// exp([q] s), and its integral along z.
Piece piece_of(const glm::dvec3& q, double s) {
  const double rate = glm::length(q);
  const double angle = rate * s;
  // sin(a) / a, (1 - cos a) / a^2, (a - sin a) / a^3
  double first = 1.0 - angle * angle / 6.0;
  double second = 0.5 - angle * angle / 24.0;
  double third = 1.0 / 6.0 - angle * angle / 120.0;
  if (angle > kSmallAngle) {
    first = std::sin(angle) / angle;
    second = (1.0 - std::cos(angle)) / (angle * angle);
    third = (angle - std::sin(angle)) / (angle * angle * angle);
  }
  const glm::dmat3 spin = s * cross_matrix(q);
  Piece piece;
  piece.turn = glm::dmat3(1.0) + first * spin + second * (spin * spin);
  piece.way_m = s * (kAlongPiece + second * (spin * kAlongPiece) + third * (spin * (spin * kAlongPiece)));
  return piece;
}

/// Solves a symmetric positive system by Cholesky's method; empty when it is not positive.
std::vector<double> solved(std::vector<double> matrix, std::vector<double> right) {
  const size_t n = right.size();
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j <= i; ++j) {
      double sum = matrix[i * n + j];
      for (size_t k = 0; k < j; ++k) sum -= matrix[i * n + k] * matrix[j * n + k];
      if (i == j && !(sum > 0.0)) return {};
      matrix[i * n + j] = i == j ? std::sqrt(sum) : sum / matrix[j * n + j];
    }
    for (size_t k = 0; k < i; ++k) right[i] -= matrix[i * n + k] * right[k];
    right[i] /= matrix[i * n + i];
  }
  for (size_t i = n; i-- > 0;) {
    for (size_t k = i + 1; k < n; ++k) right[i] -= matrix[k * n + i] * right[k];
    right[i] /= matrix[i * n + i];
  }
  return right;
}

/// Bends at the inner vertices of a polyline as complex numbers, in a frame carried along without twist.
struct Bends {
  glm::dquat first_frame{1.0, 0.0, 0.0, 0.0};  // of the first edge
  std::vector<std::complex<double>> bend;      // before edge k: angle about x + i angle about y; 0 for k = 0
};

Bends bends_of(std::span<const glm::dvec3> points_m) {
  Bends bends;
  glm::dvec3 along(0.0, 1.0, 0.0);
  glm::dquat frame(1.0, 0.0, 0.0, 0.0);
  for (size_t k = 0; k + 1 < points_m.size(); ++k) {
    const glm::dvec3 next = direction_or(points_m[k + 1] - points_m[k], along);
    if (k == 0) {
      frame = smallest_rotation(kAlongPiece, next);
      bends.first_frame = frame;
      bends.bend.emplace_back(0.0, 0.0);
    } else {
      const glm::dquat turn = smallest_rotation(along, next);
      const glm::dvec3 axis = glm::conjugate(frame) * (2.0 * glm::dvec3(turn.x, turn.y, turn.z));
      bends.bend.emplace_back(axis.x, axis.y);
      frame = turn * frame;
    }
    along = next;
  }
  return bends;
}

/// Constant curvatures in a frame that twists at a constant rate: what the bends of each element are nearest
/// to on average.
std::vector<glm::dvec3> averaged_curvatures(const HelixLine& line, const Bends& bends) {
  std::vector<glm::dvec3> natural(line.element_m.size(), glm::dvec3(0.0));
  const size_t n = line.edge_m.size();
  double spin = 0.0;
  for (size_t begin = 0; begin < n;) {
    size_t end = begin;
    while (end < n && line.element[end] == line.element[begin]) ++end;
    const auto span_m = [&line](size_t k) { return 0.5 * (line.edge_m[k - 1] + line.edge_m[k]); };
    std::complex<double> turning(0.0, 0.0);
    double spacing = 0.0;
    for (size_t k = std::max<size_t>(begin, 1); k + 1 < end; ++k) {
      turning += std::conj(bends.bend[k]) * bends.bend[k + 1];
      spacing = std::max(spacing, line.edge_m[k]);
    }
    const double rate = std::abs(turning) > 1e-12 && spacing > 0.0 ? std::arg(turning) / spacing : 0.0;
    std::complex<double> sum(0.0, 0.0);
    double length = 0.0;
    double way = 0.0;
    for (size_t k = begin; k < end; ++k) {
      if (k > 0) {
        sum += bends.bend[k] * std::polar(1.0, -(spin + rate * way));
        length += span_m(k);
      }
      way += line.edge_m[k];
    }
    if (length > 0.0) sum /= length;
    natural[line.element[begin]] = {sum.real(), sum.imag(), rate};
    spin += rate * way;
    begin = end;
  }
  return natural;
}

}  // namespace

HelixShape make_helix_shape(const HelixLine& line, std::span<const glm::dvec3> q, const glm::dvec3& root_m,
                            const glm::dquat& clamp) {
  HelixShape shape;
  const size_t n = line.edge_m.size();
  shape.vertex_m.reserve(n);
  shape.point.reserve(kHelixPoints * n);
  glm::dmat3 frame = glm::mat3_cast(clamp);
  glm::dvec3 position = root_m;
  for (size_t k = 0; k < n; ++k) {
    const double length = line.edge_m[k];
    const glm::dvec3& curvature = q[line.element[k]];
    for (const double side : {-kGaussPoint, kGaussPoint}) {
      const Piece piece = piece_of(curvature, (0.5 + side) * length);
      shape.point.push_back({frame * piece.turn, position + frame * piece.way_m, 0.5 * length});
    }
    const Piece piece = piece_of(curvature, length);
    position += frame * piece.way_m;
    frame = frame * piece.turn;
    shape.vertex_m.push_back(position + frame * line.offset_m[k]);
  }
  return shape;
}

// A turn w at a point moves every vertex behind it by w x (X - x). So the gradient at a point is the moment
// of what lies behind, and the second derivative for turns a before b is g.(a x (b x r)), r = X - x_b,
// summed.
HelixDerivatives make_helix_derivatives(const HelixLine& line, const HelixShape& shape,
                                        std::span<const VertexEnergy> energy) {
  const size_t n = line.edge_m.size();
  const size_t size = 3 * line.element_m.size();
  HelixDerivatives result;
  result.gradient.assign(size, 0.0);
  result.gauss_newton.assign(size * size, 0.0);
  std::vector<double> curved(size * size, 0.0);

  // Of the points so far: sums of turns, and of their shares of a vertex's way that do not depend on it.
  std::vector<glm::dvec3> turn(size, glm::dvec3(0.0));
  std::vector<glm::dvec3> way(size, glm::dvec3(0.0));
  std::vector<glm::dvec3> force(n + 1, glm::dvec3(0.0));   // behind edge k
  std::vector<glm::dmat3> moment(n + 1, glm::dmat3(0.0));  // sum of X g^T
  for (size_t k = n; k-- > 0;) {
    force[k] = force[k + 1] + energy[k].gradient;
    moment[k] = moment[k + 1] + glm::outerProduct(shape.vertex_m[k], energy[k].gradient);
  }
  std::vector<glm::dvec3> jacobian(size);
  std::vector<glm::dvec3> pushed(size);
  for (size_t k = 0; k < n; ++k) {
    const size_t begin = 3 * line.element[k];
    for (size_t p = kHelixPoints * k; p < kHelixPoints * (k + 1); ++p) {
      const HelixPoint& point = shape.point[p];
      const glm::dmat3 lever = moment[k] - glm::outerProduct(point.position_m, force[k]);
      const double trace = lever[0][0] + lever[1][1] + lever[2][2];
      for (int c = 0; c < 3; ++c) {
        const glm::dvec3 w = point.weight_m * point.frame[c];
        turn[begin + static_cast<size_t>(c)] += 0.5 * w;
      }
      for (int c = 0; c < 3; ++c) {
        const glm::dvec3 w = point.weight_m * point.frame[c];
        const size_t column = begin + static_cast<size_t>(c);
        // w . sum of r x g; column r of `lever` holds its parts.
        const glm::dvec3 torque(lever[2][1] - lever[1][2], lever[0][2] - lever[2][0],
                                lever[1][0] - lever[0][1]);
        result.gradient[column] += glm::dot(w, torque);
        const glm::dvec3 bent = lever * w - trace * w;
        for (size_t row = 0; row < begin + 3; ++row) curved[row * size + column] += glm::dot(turn[row], bent);
        way[column] += glm::cross(point.position_m, w);
      }
      for (int c = 0; c < 3; ++c)
        turn[begin + static_cast<size_t>(c)] += 0.5 * point.weight_m * point.frame[c];
    }
    for (size_t c = 0; c < begin + 3; ++c) {
      jacobian[c] = way[c] - glm::cross(shape.vertex_m[k], turn[c]);
      pushed[c] = energy[k].stiffness * jacobian[c];
    }
    for (size_t r = 0; r < begin + 3; ++r)
      for (size_t c = 0; c <= r; ++c) result.gauss_newton[r * size + c] += glm::dot(jacobian[r], pushed[c]);
  }
  for (size_t r = 0; r < size; ++r)
    for (size_t c = 0; c < r; ++c) result.gauss_newton[c * size + r] = result.gauss_newton[r * size + c];
  result.matrix = result.gauss_newton;
  for (size_t r = 0; r < size; ++r)
    for (size_t c = 0; c < size; ++c)
      result.matrix[r * size + c] += curved[r * size + c] + curved[c * size + r];
  return result;
}

namespace {

double elastic_energy(const HelixElastic& elastic, std::span<const glm::dvec3> q) {
  double energy = 0.0;
  for (size_t e = 0; e < q.size(); ++e) {
    const glm::dvec3 strain = q[e] - elastic.center[e];
    energy += 0.5 * glm::dot(elastic.stiffness[e], strain * strain);
  }
  return energy;
}

/// The Newton step; with the second derivative where that is positive, else without the shape's own.
std::vector<double> newton_step(const HelixProblem& problem, const HelixShape& shape,
                                const std::vector<VertexEnergy>& derivatives, std::span<const glm::dvec3> q) {
  HelixDerivatives at = make_helix_derivatives(*problem.line, shape, derivatives);
  const size_t size = at.gradient.size();
  std::vector<double> right(size);
  // A limp strand does not answer to its own twist at all.
  double largest = 0.0;
  for (size_t i = 0; i < size; ++i) largest = std::fmax(largest, at.gauss_newton[i * size + i]);
  for (size_t i = 0; i < size; ++i) {
    const int c = static_cast<int>(i % 3);
    const double stiffness = problem.elastic.stiffness[i / 3][c];
    right[i] = -(at.gradient[i] + stiffness * (q[i / 3][c] - problem.elastic.center[i / 3][c]));
    at.matrix[i * size + i] += stiffness + kLeastShare * largest;
    at.gauss_newton[i * size + i] += stiffness + kLeastShare * largest;
  }
  std::vector<double> step = solved(at.matrix, right);
  for (double share = 1e-9; step.empty() && share < 1.0; share *= 1e3) {
    std::vector<double> matrix = at.gauss_newton;
    for (size_t i = 0; i < size; ++i) matrix[i * size + i] *= 1.0 + share;
    step = solved(std::move(matrix), right);
  }
  return step;
}

}  // namespace

void settle_helix(const HelixProblem& problem, std::span<glm::dvec3> q) {
  const HelixLine& line = *problem.line;
  std::vector<VertexEnergy> derivatives(line.edge_m.size());
  std::vector<glm::dvec3> tried(q.begin(), q.end());
  for (uint32_t k = 0; k < problem.most_steps; ++k) {
    const HelixShape shape = make_helix_shape(line, q, problem.root_m, problem.clamp);
    const double before = problem.energy(shape, &derivatives) + elastic_energy(problem.elastic, q);
    const std::vector<double> step = newton_step(problem, shape, derivatives, q);
    double most = 0.0;
    for (size_t i = 0; i < step.size(); ++i)
      most = std::fmax(most, std::abs(step[i]) * line.element_m[i / 3]);
    if (step.empty() || !std::isfinite(most)) return;
    double share = std::min(1.0, kMaxPieceTurnRad / std::max(most, kTinyTurnRad));
    bool is_lower = false;
    for (int halving = 0; halving < kMostHalvings && !is_lower; ++halving, share *= 0.5) {
      for (size_t e = 0; e < q.size(); ++e)
        tried[e] = q[e] + share * glm::dvec3(step[3 * e], step[3 * e + 1], step[3 * e + 2]);
      const HelixShape next = make_helix_shape(line, tried, problem.root_m, problem.clamp);
      is_lower = problem.energy(next, nullptr) + elastic_energy(problem.elastic, tried) <= before;
    }
    if (!is_lower) return;
    std::copy(tried.begin(), tried.end(), q.begin());
    if (most < kEndTurnRad) return;
  }
}

HelixLine make_helix_line(std::span<const glm::dvec3> points_m, uint32_t element_count) {
  HelixLine line;
  const size_t n = points_m.size() - 1;
  const size_t elements = std::clamp<size_t>(element_count, 1, n);
  line.element_m.assign(elements, 0.0);
  double length = 0.0;
  for (size_t k = 0; k < n; ++k) {
    line.edge_m.push_back(std::max(glm::distance(points_m[k], points_m[k + 1]), kMinEdgeM));
    line.element.push_back(static_cast<uint32_t>(k * elements / n));
    line.element_m[line.element.back()] += line.edge_m.back();
    length += line.edge_m.back();
  }
  line.offset_m.assign(n, glm::dvec3(0.0));
  const Bends bends = bends_of(points_m);
  line.natural = averaged_curvatures(line, bends);
  // The edge is a chord: the line itself begins half an edge's bend earlier.
  const glm::dvec3 half_way = -0.5 * line.edge_m[0] * line.natural[0];
  line.clamp = glm::normalize(bends.first_frame * glm::dquat(1.0, 0.5 * half_way));

  HelixProblem fit;
  fit.line = &line;
  fit.root_m = points_m[0];
  fit.clamp = line.clamp;
  fit.elastic.center = line.natural;
  fit.elastic.stiffness.assign(elements, glm::dvec3(kFitShare * std::pow(length, 4)));
  fit.most_steps = kFitSteps;
  fit.energy = [&points_m](const HelixShape& shape, std::vector<VertexEnergy>* derivatives) {
    double energy = 0.0;
    for (size_t i = 0; i < shape.vertex_m.size(); ++i) {
      const glm::dvec3 off = shape.vertex_m[i] - points_m[i + 1];
      energy += 0.5 * glm::dot(off, off);
      if (derivatives != nullptr) (*derivatives)[i] = {off, glm::dmat3(1.0)};
    }
    return energy;
  };
  std::vector<glm::dvec3> natural = line.natural;
  settle_helix(fit, natural);
  line.natural = natural;
  const HelixShape shape = make_helix_shape(line, line.natural, points_m[0], line.clamp);
  glm::dmat3 frame = glm::mat3_cast(line.clamp);
  for (size_t k = 0; k < n; ++k) {
    frame = frame * piece_of(line.natural[line.element[k]], line.edge_m[k]).turn;
    line.offset_m[k] = glm::transpose(frame) * (points_m[k + 1] - shape.vertex_m[k]);
  }
  return line;
}

}  // namespace strandcast
