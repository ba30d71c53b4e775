// The peer of bench/inverse_kinematics: KDL's two iterative solvers on the same arms, poses and seeds. A program of its
// own, built by `make bench-peers` against Debian's KDL and Debian's Eigen, of which nothing enters our build.
//
// usage: kdl_inverse FILE      FILE: what bench/inverse_kinematics writes; see its Case::write()
// prints one line a solver: NAME SOLVED MEDIAN_US MEAN_US P99_US WORST_ERROR     (m and rad; solved: reached and in
// limits)

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <functional>
#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainiksolverpos_lma.hpp>
#include <kdl/chainiksolverpos_nr_jl.hpp>
#include <kdl/chainiksolvervel_pinv.hpp>
#include <random>
#include <string>
#include <vector>

namespace {

constexpr double kReached = 1e-5;  // m and rad: the bar both sides are held to
constexpr int kRestarts = 20;      // attempts from random joints, of the solvers that have them

struct Query {
  KDL::Frame target;
  KDL::JntArray seed;
};

struct Case {
  KDL::Chain chain;
  KDL::JntArray low, high;
  std::vector<Query> queries;
};

KDL::Vector read_vector(std::istream& file) {
  double x = 0, y = 0, z = 0;
  file >> x >> y >> z;
  return {x, y, z};
}

KDL::Frame read_frame(std::istream& file) {
  KDL::Frame frame;
  frame.p = read_vector(file);
  for (double& value : frame.M.data) file >> value;
  return frame;
}

KDL::JntArray read_joints(std::istream& file, unsigned axes) {
  KDL::JntArray q(axes);
  for (unsigned i = 0; i < axes; ++i) file >> q(i);
  return q;
}

bool read_case(const char* path, Case& read) {
  std::ifstream file(path);
  unsigned axes = 0;
  std::size_t queries = 0;
  file >> axes >> queries;
  std::vector<KDL::Vector> axis(axes), point(axes);
  for (unsigned i = 0; i < axes; ++i) {
    axis[i] = read_vector(file);
    point[i] = read_vector(file);
  }
  const KDL::Frame tip = read_frame(file);
  KDL::Vector here = KDL::Vector::Zero();
  for (unsigned i = 0; i < axes; ++i) {
    const KDL::Joint joint("j" + std::to_string(i), point[i] - here, axis[i], KDL::Joint::RotAxis);
    const KDL::Frame end = i + 1 < axes ? KDL::Frame(point[i] - here) : KDL::Frame(tip.M, tip.p - here);
    read.chain.addSegment(KDL::Segment(joint, end));
    here = point[i];
  }
  read.low = read_joints(file, axes);
  read.high = read_joints(file, axes);
  for (std::size_t i = 0; i < queries; ++i) {
    const KDL::Frame target = read_frame(file);
    read.queries.push_back({target, read_joints(file, axes)});
  }
  return axes > 0 && !file.fail();
}

using Solve = std::function<int(const KDL::JntArray&, const KDL::Frame&, KDL::JntArray&)>;

// Whole turns into the limits, in favour of the solver that knows none.
bool into_limits(const Case& of, KDL::JntArray& q) {
  for (unsigned i = 0; i < q.rows(); ++i) {
    q(i) = std::remainder(q(i), 2 * M_PI);
    if (q(i) < of.low(i)) q(i) += 2 * M_PI;
    if (q(i) > of.high(i)) q(i) -= 2 * M_PI;
    if (q(i) < of.low(i) || q(i) > of.high(i)) return false;
  }
  return true;
}

void run(const char* name, const Case& of, int attempts, const Solve& solve) {
  KDL::ChainFkSolverPos_recursive forward(of.chain);
  std::vector<double> took_us;
  std::mt19937_64 random(1);
  std::size_t solved = 0;
  double worst = 0;
  KDL::JntArray q(of.low.rows()), seed(of.low.rows());
  for (const Query& query : of.queries) {
    seed = query.seed;
    bool done = false;
    const auto begin = std::chrono::steady_clock::now();
    for (int attempt = 0; attempt < attempts && !done; ++attempt) {
      done = solve(seed, query.target, q) >= 0 && into_limits(of, q);
      for (unsigned i = 0; i < seed.rows(); ++i)
        seed(i) = std::uniform_real_distribution(of.low(i), of.high(i))(random);
    }
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - begin;
    took_us.push_back(took.count());
    if (!done) continue;
    KDL::Frame reached;
    forward.JntToCart(q, reached);
    const KDL::Twist off = KDL::diff(reached, query.target);
    const double error = std::max(off.vel.Norm(), off.rot.Norm());
    if (error > kReached) continue;
    ++solved;
    worst = std::max(worst, error);
  }
  double sum = 0;
  for (const double us : took_us) sum += us;
  std::sort(took_us.begin(), took_us.end());
  const std::size_t count = took_us.size();
  std::printf("%s %zu %.3f %.3f %.3f %.2e\n", name, solved, took_us[count / 2], sum / static_cast<double>(count),
              took_us[count * 99 / 100], worst);
}

}  // namespace

int main(int argc, char** argv) {
  Case read;
  if (argc != 2 || !read_case(argv[1], read) || read.queries.empty()) {
    std::fprintf(stderr, "kdl_inverse: usage: kdl_inverse FILE, as bench/inverse_kinematics writes it\n");
    return 2;
  }
  // All six components weighed alike, as the bar does; its default forgives rotations a hundred times more.
  const Eigen::Matrix<double, 6, 1> alike = Eigen::Matrix<double, 6, 1>::Ones();
  KDL::ChainIkSolverPos_LMA lma(read.chain, alike, 1e-6, 500);
  KDL::ChainFkSolverPos_recursive forward(read.chain);
  KDL::ChainIkSolverVel_pinv velocity(read.chain);
  KDL::ChainIkSolverPos_NR_JL newton(read.chain, read.low, read.high, forward, velocity, 100, 1e-6);
  const Solve by_lma = [&](const auto& seed, const auto& target, auto& q) { return lma.CartToJnt(seed, target, q); };
  const Solve by_newton = [&](const auto& seed, const auto& target, auto& q) {
    return newton.CartToJnt(seed, target, q);
  };
  run("LMA", read, 1, by_lma);
  run("NR_JL", read, 1, by_newton);
  run("LMA+restarts", read, 1 + kRestarts, by_lma);
  run("NR_JL+restarts", read, 1 + kRestarts, by_newton);
}
