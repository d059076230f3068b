// nav2_amcl's particle filter as a peer of python/benchmarks/localisation_peers.py, which describes what is read and
// printed.
//
// The filter, likelihood field and motion model are nav2_amcl's own sources, compiled as they are. They are LGPL, and
// no part of this project: build_nav2_amcl.sh beside this file compiles them from a checkout. What stands here is what
// amcl_node.cpp does between its messages (commit a3a97043ee93d92fe8d70ec56d183933169beb1c), without ROS:
//
// - Every parameter is the default that amcl_node.cpp declares: laser_model_type likelihood_field, max_beams 60,
//   sigma_hit 0.2, z_hit and z_rand 0.5, laser_likelihood_max_dist 2.0, differential motion with every alpha 0.2, 500
//   to 2000 particles, pf_err 0.05, pf_z 0.99, no random poses, resampling at each update, update_min_d 0.25,
//   update_min_a 0.2, and 0.5 m and 15 degrees of standard deviation at a given start.
// - From anywhere it has up to 20,000 particles, ten times Nav2's default, at first evenly over free cells.
// - pf_init() seeds the random numbers with the count of its calls. So the start is drawn here, from the same Gaussian,
//   and the seed has an effect.
// - After its five arguments it takes `alpha=NUMBER` for all five alphas, and
//   `laser_model_type=likelihood_field_prob`. A script of two lines makes another peer of that:
//     #!/bin/sh
//     exec "$(dirname "$0")/nav2_amcl" "$@" alpha=0.02
// - The pose at each scan is that of the transform from map to odometry, composed with odometry. The covariance is that
//   of the last amcl_pose. "Converged" is pf_t::converged: every particle within 0.5 m of the mean on both axes.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "nav2_amcl/angleutils.hpp"
#include "nav2_amcl/map/map.hpp"
#include "nav2_amcl/motion_model/differential_motion_model.hpp"
#include "nav2_amcl/pf/pf.hpp"
#include "nav2_amcl/pf/pf_pdf.hpp"
#include "nav2_amcl/sensors/laser/laser.hpp"

namespace {

constexpr double kUpdateMinD = 0.25;
constexpr double kUpdateMinA = 0.2;
constexpr double kRangeMax = 100.0;
constexpr double kStartSigma = 0.5;
constexpr double kStartSigmaHeading = M_PI / 12.0;

struct Scanner {
  pf_vector_t mounted;
  double step;
  double range_max;
};

struct Reading {
  std::string stamp;
  pf_vector_t odometry;
  std::vector<double> ranges;
};

// What may be set otherwise than Nav2 does.
struct Settings {
  int particles;
  double alpha = 0.2;
  bool prob = false;
};

struct Log {
  Scanner scanner;
  std::vector<Reading> readings;
};

struct Estimate {
  pf_vector_t pose;
  pf_matrix_t covariance;
  bool converged;
};

struct Cell {
  int i;
  int j;
};

std::vector<Cell> free_cells;

map_t * read_map(const std::string & path) {
  std::ifstream file(path);
  map_t * map = map_alloc();
  double x;
  double y;
  if (!(file >> map->size_x >> map->size_y >> map->scale >> x >> y)) throw std::runtime_error(path + ": no map");
  // As AmclNode::convertMap().
  map->origin_x = x + (map->size_x / 2) * map->scale;
  map->origin_y = y + (map->size_y / 2) * map->scale;
  const size_t count = static_cast<size_t>(map->size_x) * map->size_y;
  map->cells = static_cast<map_cell_t *>(malloc(sizeof(map_cell_t) * count));
  for (size_t k = 0; k < count; k++) {
    int cell;
    if (!(file >> cell)) throw std::runtime_error(path + ": it has too few cells");
    map->cells[k].occ_state = cell == 0 ? -1 : cell == 100 ? 1 : 0;
    if (cell == 0) free_cells.push_back({static_cast<int>(k % map->size_x), static_cast<int>(k / map->size_x)});
  }
  if (free_cells.empty()) throw std::runtime_error(path + ": no cell is free");
  return map;
}

// A range that is no number is written "nan", which operator>> does not read.
double number(std::istringstream & words) {
  std::string word;
  if (!(words >> word)) throw std::runtime_error("a line of the log is too short");
  return std::strtod(word.c_str(), nullptr);
}

Log read_log(const std::string & path) {
  std::ifstream file(path);
  std::string line;
  std::string word;
  if (!std::getline(file, line)) throw std::runtime_error(path + ": no log");
  std::istringstream head(line);
  Log log;
  head >> word;
  for (double & value : log.scanner.mounted.v) value = number(head);
  log.scanner.step = number(head);
  log.scanner.range_max = number(head);
  while (std::getline(file, line)) {
    std::istringstream words(line);
    Reading reading;
    words >> reading.stamp;
    for (double & value : reading.odometry.v) value = number(words);
    reading.ranges.resize(static_cast<size_t>(number(words)));
    for (double & range : reading.ranges) range = number(words);
    log.readings.push_back(reading);
  }
  return log;
}

// AmclNode::uniformPoseGenerator().
pf_vector_t pose_anywhere(void * arg) {
  const map_t * map = static_cast<map_t *>(arg);
  const Cell cell = free_cells[static_cast<size_t>(drand48() * free_cells.size())];
  pf_vector_t pose;
  pose.v[0] = MAP_WXGX(map, cell.i);
  pose.v[1] = MAP_WYGY(map, cell.j);
  pose.v[2] = drand48() * 2 * M_PI - M_PI;
  return pose;
}

pf_vector_t pose_near_start(void * arg) {
  pf_vector_t pose = *static_cast<pf_vector_t *>(arg);
  pose.v[0] += pf_ran_gaussian(kStartSigma);
  pose.v[1] += pf_ran_gaussian(kStartSigma);
  pose.v[2] += pf_ran_gaussian(kStartSigmaHeading);
  return pose;
}

// A pose in the frame of another.
pf_vector_t seen_from(const pf_vector_t & frame, const pf_vector_t & pose) {
  const double x = pose.v[0] - frame.v[0];
  const double y = pose.v[1] - frame.v[1];
  pf_vector_t seen;
  seen.v[0] = x * std::cos(frame.v[2]) + y * std::sin(frame.v[2]);
  seen.v[1] = y * std::cos(frame.v[2]) - x * std::sin(frame.v[2]);
  seen.v[2] = nav2_amcl::angleutils::angle_diff(pose.v[2], frame.v[2]);
  return seen;
}

// AmclNode::laserReceived() and what it calls.
class Amcl {
 public:
  Amcl(map_t * map, const Scanner & scanner, const Settings & settings) : map_(map), scanner_(scanner) {
    if (settings.prob) {
      field_ = std::make_unique<nav2_amcl::LikelihoodFieldModelProb>(
        0.5, 0.5, 0.2, 2.0, false, 0.5, 0.3, 0.9, 60, map);
    } else {
      field_ = std::make_unique<nav2_amcl::LikelihoodFieldModel>(0.5, 0.5, 0.2, 2.0, 60, map);
    }
    pf_ = pf_alloc(std::min(500, settings.particles), settings.particles, 0.0, 0.0, pose_anywhere);
    pf_->pop_err = 0.05;
    pf_->pop_z = 0.99;
    const double alpha = settings.alpha;
    motion_.initialize(alpha, alpha, alpha, alpha, alpha);
    pf_vector_t mounted = scanner.mounted;
    mounted.v[2] = 0.0;
    field_->SetLaserPose(mounted);
  }

  void start_at(pf_vector_t pose) { pf_init_model(pf_, pose_near_start, &pose); }

  void start_anywhere() { pf_init_model(pf_, pose_anywhere, map_); }

  Estimate take(const Reading & reading) {
    const pf_vector_t & odometry = reading.odometry;
    if (!begun_) {
      begun_ = true;
      update(reading);
    } else {
      pf_vector_t delta;
      delta.v[0] = odometry.v[0] - updated_at_.v[0];
      delta.v[1] = odometry.v[1] - updated_at_.v[1];
      delta.v[2] = nav2_amcl::angleutils::angle_diff(odometry.v[2], updated_at_.v[2]);
      const bool moved = std::fabs(delta.v[0]) > kUpdateMinD || std::fabs(delta.v[1]) > kUpdateMinD;
      if (moved || std::fabs(delta.v[2]) > kUpdateMinA) {
        motion_.odometryUpdate(pf_, odometry, delta);
        update(reading);
      }
    }
    // The robot's pose by the transform from map to odometry of the last update.
    const pf_vector_t pose = pf_vector_coord_add(seen_from(updated_at_, odometry), heaviest_);
    return {pose, pf_->sets[pf_->current_set].cov, pf_->converged != 0};
  }

  int updates() const { return updates_; }

 private:
  void update(const Reading & reading) {
    nav2_amcl::LaserData data;
    data.laser = field_.get();
    data.range_count = static_cast<int>(reading.ranges.size());
    data.range_max = std::min(scanner_.range_max, kRangeMax);
    data.ranges = new double[data.range_count][2];
    for (int k = 0; k < data.range_count; k++) {
      data.ranges[k][0] = reading.ranges[k] <= 0.0 ? data.range_max : reading.ranges[k];
      data.ranges[k][1] = scanner_.mounted.v[2] + k * scanner_.step;
    }
    field_->sensorUpdate(pf_, &data);
    pf_update_resample(pf_, map_);
    updated_at_ = reading.odometry;
    updates_++;
    double most = 0.0;
    for (int cluster = 0; cluster < pf_->sets[pf_->current_set].cluster_count; cluster++) {
      double weight;
      pf_vector_t mean;
      pf_matrix_t covariance;
      if (pf_get_cluster_stats(pf_, cluster, &weight, &mean, &covariance) && weight > most) {
        most = weight;
        heaviest_ = mean;
      }
    }
  }

  map_t * map_;
  Scanner scanner_;
  std::unique_ptr<nav2_amcl::Laser> field_;
  nav2_amcl::DifferentialMotionModel motion_;
  pf_t * pf_;
  pf_vector_t updated_at_ = pf_vector_zero();
  pf_vector_t heaviest_ = pf_vector_zero();
  int updates_ = 0;
  bool begun_ = false;
};

Settings read_settings(const std::vector<std::string> & arguments, bool anywhere) {
  Settings settings;
  settings.particles = anywhere ? 20000 : 2000;
  if (arguments[4] != "default") settings.particles = std::stoi(arguments[4]);
  for (size_t k = 5; k < arguments.size(); k++) {
    const std::string & setting = arguments[k];
    if (setting.rfind("alpha=", 0) == 0) {
      settings.alpha = std::stod(setting.substr(6));
    } else if (setting == "laser_model_type=likelihood_field_prob") {
      settings.prob = true;
    } else {
      throw std::runtime_error("it has no setting " + setting);
    }
  }
  return settings;
}

int run(const std::vector<std::string> & arguments) {
  if (arguments.size() < 5) throw std::runtime_error("usage: nav2_amcl MAP LOG START SEED PARTICLES [NAME=VALUE...]");
  map_t * map = read_map(arguments[0]);
  const Log log = read_log(arguments[1]);
  const bool anywhere = arguments[2] == "anywhere";
  const Settings settings = read_settings(arguments, anywhere);
  Amcl amcl(map, log.scanner, settings);
  const auto began = std::chrono::steady_clock::now();
  srand48(std::stol(arguments[3]));
  if (anywhere) {
    amcl.start_anywhere();
  } else {
    pf_vector_t start;
    if (std::sscanf(arguments[2].c_str(), "%lf,%lf,%lf", &start.v[0], &start.v[1], &start.v[2]) != 3) {
      throw std::runtime_error("START is no x,y,heading: " + arguments[2]);
    }
    amcl.start_at(start);
  }
  std::vector<Estimate> estimates;
  for (const Reading & reading : log.readings) estimates.push_back(amcl.take(reading));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  for (size_t k = 0; k < estimates.size(); k++) {
    const pf_vector_t & pose = estimates[k].pose;
    const pf_matrix_t & covariance = estimates[k].covariance;
    std::printf("%s %.9g %.9g %.9g", log.readings[k].stamp.c_str(), pose.v[0], pose.v[1], pose.v[2]);
    std::printf(" %.9g %.9g %.9g %.9g", covariance.m[0][0], covariance.m[0][1], covariance.m[1][1], covariance.m[2][2]);
    std::printf(" %d\n", estimates[k].converged ? 1 : 0);
  }
  std::printf("updates %d seconds %.6f\n", amcl.updates(), took.count());
  return 0;
}

}  // namespace

int main(int argc, char ** argv) {
  try {
    return run(std::vector<std::string>(argv + 1, argv + argc));
  } catch (const std::exception & error) {
    std::cerr << error.what() << std::endl;
    return 1;
  }
}
