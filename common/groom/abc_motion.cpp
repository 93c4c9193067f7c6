#include "common/groom/abc_motion.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "common/groom/abc_curves.h"
#include "common/groom/abc_tree.h"
#include "common/math/rigid_fit.h"

namespace strandcast {
namespace {

/// One object of curves, and the sample that was read last.
struct MovedCurves {
  size_t node = 0;
  AbcCurvesReader reader;
  uint64_t sample = 0;
};

glm::dvec3 middle_of(std::span<const glm::dvec3> points) {
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

class CurveMotionReading {
 public:
  CurveMotionReading(const AbcArchive& archive, const AbcTree& tree) : archive_(archive), tree_(tree) {}

  Result<CurveMotion> run() {
    RETURN_IF_ERROR(find_curves());
    ASSIGN_OR_RETURN(const std::vector<double> times, sample_times());
    CurveMotion motion;
    ASSIGN_OR_RETURN(const std::vector<glm::dvec3> first, roots_at(times.front()));
    motion.object_count = curves_.size();
    motion.root_count = first.size();
    motion.is_behind_rest = begins_at_rest() && times.size() > 2;
    const size_t begin = motion.is_behind_rest ? 1 : 0;
    glm::dquat rotation(1.0, 0.0, 0.0, 0.0);
    for (size_t i = begin; i < times.size(); ++i) {
      const double time_s = times[i];
      ASSIGN_OR_RETURN(const std::vector<glm::dvec3> roots, roots_at(time_s));
      if (roots.size() != first.size())
        return make_error(ErrorCode::BadInput, "{} strands at {:.6g} s, but {} at first: they come and go",
                          roots.size(), time_s, first.size());
      const Pose pose = rigid_fit(first, roots, rotation);
      rotation = pose.rotation;
      RETURN_IF_ERROR(check_rigid(first, roots, pose, time_s));
      motion.time_s.push_back(time_s - times[begin]);
      motion.from_first.push_back(pose);
    }
    return motion;
  }

 private:
  /// Whether it is an export of ours, which says so.
  bool begins_at_rest() const {
    return abc_metadata_value(archive_.metadata(), "_ai_Description").find(kAbcRestSample) !=
           std::string_view::npos;
  }

  /// Whether all roots are where the movement takes them.
  static Status check_rigid(std::span<const glm::dvec3> first, std::span<const glm::dvec3> roots,
                            const Pose& pose, double time_s) {
    const glm::dvec3 middle = middle_of(first);
    double size = 0.0, farthest = 0.0;
    size_t worst = 0;
    for (size_t i = 0; i < roots.size(); ++i) {
      size += glm::distance(first[i], middle) / static_cast<double>(first.size());
      const double off = glm::distance(pose * first[i], roots[i]);
      if (off <= farthest) continue;
      farthest = off;
      worst = i;
    }
    if (farthest <= kRigidShare * size) return {};
    return make_error(ErrorCode::BadInput,
                      "at {:.6g} s the root of strand {} is {:.4g} units from where the others go: only hair "
                      "that moves as one can move a head",
                      time_s, worst, farthest);
  }

  Status find_curves() {
    for (size_t node = 0; node < tree_.nodes().size(); ++node) {
      const AbcNode& one = tree_.nodes()[node];
      if (one.kind != AbcKind::Curves || !one.is_visible) continue;
      ASSIGN_OR_RETURN(AbcCurvesReader reader, AbcCurvesReader::open(archive_, one.object));
      curves_.push_back({node, std::move(reader), 0});
    }
    if (curves_.empty()) return make_error(ErrorCode::BadInput, "there are no curves");
    return {};
  }

  /// Of the curves with the most samples; where points stand still, of the transform with the most.
  Result<std::vector<double>> sample_times() const {
    std::vector<double> times;
    const auto take = [&](uint64_t count, const auto& time_of) {
      if (count <= times.size()) return;
      times.clear();
      for (uint64_t i = 0; i < std::min(count, kMaxCurveMotionSamples); ++i) times.push_back(time_of(i));
    };
    for (const MovedCurves& curves : curves_) {
      take(curves.reader.sample_count(), [&](uint64_t i) { return curves.reader.time_s(i); });
      for (std::optional<size_t> node = curves.node; node; node = tree_.nodes()[*node].parent) {
        const auto& xform = tree_.nodes()[*node].xform;
        if (xform && xform->channels)
          take(xform->channels->sample_count,
               [&](uint64_t i) { return archive_.time_s(*xform->channels, i); });
      }
    }
    if (times.size() < 2)
      return make_error(ErrorCode::BadInput, "these curves do not move: they have one sample");
    if (!std::is_sorted(times.begin(), times.end(), std::less_equal<>()))
      return make_error(ErrorCode::BadInput, "its samples are not in the order of time");
    return times;
  }

  /// First points of all strands, in the file's space.
  Result<std::vector<glm::dvec3>> roots_at(double time_s) {
    constexpr double kSameTimeS = 1e-9;
    std::vector<glm::dvec3> roots;
    for (MovedCurves& curves : curves_) {
      while (curves.sample + 1 < curves.reader.sample_count() &&
             curves.reader.time_s(curves.sample + 1) <= time_s + kSameTimeS)
        ++curves.sample;
      ASSIGN_OR_RETURN(const AbcCurves now,
                       curves.reader.read(curves.sample, kMaxStrandCount, kMaxGroomVertices));
      ASSIGN_OR_RETURN(const glm::dmat4 world, tree_.world_from_node(archive_, curves.node, time_s));
      size_t point = 0;
      for (const uint32_t count : now.vertex_counts) {
        if (count > 0) {
          const glm::dvec3& root = roots.emplace_back(world * glm::dvec4(glm::dvec3(now.points[point]), 1.0));
          if (!std::isfinite(root.x + root.y + root.z))
            return make_error(ErrorCode::BadInput, "at {:.6g} s the root of strand {} is at ({}, {}, {})",
                              time_s, roots.size() - 1, root.x, root.y, root.z);
        }
        point += count;
      }
    }
    if (roots.empty()) return make_error(ErrorCode::BadInput, "there are no strands at {:.6g} s", time_s);
    return roots;
  }

  const AbcArchive& archive_;
  const AbcTree& tree_;
  std::vector<MovedCurves> curves_;
};

Result<CurveMotion> read_motion(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(AbcContainer container, AbcContainer::open(path));
  ASSIGN_OR_RETURN(const AbcArchive archive, AbcArchive::read(std::move(container)));
  ASSIGN_OR_RETURN(const AbcTree tree, AbcTree::read(archive));
  return CurveMotionReading(archive, tree).run();
}

}  // namespace

Pose CurveMotion::sample(double t_s) const {
  const auto later = std::upper_bound(time_s.begin(), time_s.end(), t_s);
  if (later == time_s.begin()) return from_first.front();
  if (later == time_s.end()) return from_first.back();
  const auto i = static_cast<size_t>(later - time_s.begin());
  return interpolate(from_first[i - 1], from_first[i], (t_s - time_s[i - 1]) / (time_s[i] - time_s[i - 1]));
}

Result<CurveMotion> load_abc_motion(const std::filesystem::path& path) {
  auto motion = read_motion(path);
  if (!motion) return at(path.string(), motion.error());
  return motion;
}

}  // namespace strandcast
