// HelixShape: the centre line of helical elements and the vertices that it carries, with first and second
// derivatives of an energy of the vertices. Plain data and algebra; any thread.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <span>
#include <vector>

namespace strandcast {

/// What does not change while a strand moves. Edge k leads to vertex k; vertex -1 is the clamp.
struct HelixLine {
  std::vector<double> edge_m;            // arc length of every edge
  std::vector<uint32_t> element;         // of every edge, rising
  std::vector<double> element_m;         // arc length of every element
  std::vector<glm::dvec3> natural;       // curvatures and twist of every element at rest, 1/m
  std::vector<glm::dvec3> offset_m;      // of every vertex, in the material frame at its arc length
  glm::dquat clamp{1.0, 0.0, 0.0, 0.0};  // material frame there, in head space: z along the strand
};

/// A point at which the derivatives are integrated; `weight_m` is its share of the arc.
struct HelixPoint {
  glm::dmat3 frame{1.0};
  glm::dvec3 position_m{0.0};
  double weight_m = 0.0;
};

/// Points per edge.
inline constexpr uint32_t kHelixPoints = 2;

struct HelixShape {
  std::vector<glm::dvec3> vertex_m;
  std::vector<HelixPoint> point;  // kHelixPoints per edge
};

/// How an energy depends on one vertex.
struct VertexEnergy {
  glm::dvec3 gradient{0.0};
  glm::dmat3 stiffness{0.0};
};

/// The shape for curvatures `q` of every element from a clamp at `root_m` with material frame `clamp`.
HelixShape make_helix_shape(const HelixLine& line, std::span<const glm::dvec3> q, const glm::dvec3& root_m,
                            const glm::dquat& clamp);

/// Gradient and matrix of second derivatives of an energy with respect to the curvatures: 3 numbers per
/// element, the matrix row by row.
struct HelixDerivatives {
  std::vector<double> gradient;
  std::vector<double> matrix;        // with the shape's own second derivative
  std::vector<double> gauss_newton;  // without: never negative
};
HelixDerivatives make_helix_derivatives(const HelixLine& line, const HelixShape& shape,
                                        std::span<const VertexEnergy> energy);

/// sum of stiffness (q - center)^2 / 2 over all elements.
struct HelixElastic {
  std::vector<glm::dvec3> stiffness;
  std::vector<glm::dvec3> center;
};

/// Energy of the vertices of a shape; fills in how it depends on each when `derivatives` is not null.
using HelixEnergy = std::function<double(const HelixShape& shape, std::vector<VertexEnergy>* derivatives)>;

/// Where a line stands, what holds it and how much may be spent on it.
struct HelixProblem {
  const HelixLine* line = nullptr;
  glm::dvec3 root_m{0.0};
  glm::dquat clamp{1.0, 0.0, 0.0, 0.0};
  HelixElastic elastic;
  HelixEnergy energy;
  uint32_t most_steps = 0;
};

/// Moves the curvatures to the nearest least of both energies by Newton's method with a line search; what it
/// ends with is never above where it began.
void settle_helix(const HelixProblem& problem, std::span<glm::dvec3> q);

/// A line whose rest shape passes through the given points (head space, the clamp first) as well as
/// `element_count` elements can; what they cannot is left to the offsets.
HelixLine make_helix_line(std::span<const glm::dvec3> points_m, uint32_t element_count);

}  // namespace strandcast
