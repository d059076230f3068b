// MRPT's particle filter, that of its program pf-localization, as a peer of python/benchmarks/localisation_peers.py,
// which describes what is read and printed. It needs the package libmrpt-slam-dev of Debian or Ubuntu (2.5.8 in Debian
// 12):
//
//   g++ -std=c++17 -O3 -DNDEBUG python/benchmarks/peers/mrpt_pf.cpp -I /usr/include/eigen3
//     $(printf -- '-isystem %s ' /usr/include/mrpt/*/include) -lmrpt-slam -lmrpt-maps -lmrpt-obs
//     -lmrpt-bayes -lmrpt-poses -lmrpt-math -lmrpt-random -lmrpt-rtti -lmrpt-serialization -lmrpt-system
//     -lmrpt-core -o mrpt_pf
//
// - The settings are those of the file that MRPT has for this, config_files/pf-localization/localization_demo.ini:
//   standard proposal, multinomial resampling below half of the effective size, 150 to 40,000 particles by KLD, and the
//   likelihood field of Thrun with every tenth beam and 0.4 m. The noise of odometry is that of its section
//   DummyOdometryParams, 0.1 m and 2 degrees, besides the defaults of the Gaussian model. Each scan is an update.
// - From anywhere it begins with all particles. At a given start it begins with 2000, 0.5 m and 15 degrees around it.
// - It does not say whether it has converged.

#include <mrpt/bayes/CParticleFilter.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/random.h>
#include <mrpt/slam/CMonteCarloLocalization2D.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using mrpt::maps::COccupancyGridMap2D;
using mrpt::obs::CActionRobotMovement2D;
using mrpt::obs::CObservation2DRangeScan;
using mrpt::poses::CPose2D;

struct Reading {
  std::string stamp;
  CPose2D odometry;
  CObservation2DRangeScan::Ptr scan;
};

// A range that is no number is written "nan", which operator>> does not read.
double number(std::istringstream & words) {
  std::string word;
  if (!(words >> word)) throw std::runtime_error("a line of the log is too short");
  return std::strtod(word.c_str(), nullptr);
}

COccupancyGridMap2D::Ptr read_map(const std::string & path) {
  std::ifstream file(path);
  unsigned width;
  unsigned height;
  double resolution;
  double x;
  double y;
  if (!(file >> width >> height >> resolution >> x >> y)) throw std::runtime_error(path + ": no map");
  auto map = COccupancyGridMap2D::Create();
  map->setSize(x, x + width * resolution, y, y + height * resolution, resolution, 0.5f);
  if (map->getSizeX() != width || map->getSizeY() != height || std::fabs(map->getXMin() - x) > 0.1 * resolution ||
      std::fabs(map->getYMin() - y) > 0.1 * resolution) {
    throw std::runtime_error(path + ": its corner is no multiple of its resolution");
  }
  for (unsigned j = 0; j < height; j++) {
    for (unsigned i = 0; i < width; i++) {
      int cell;
      if (!(file >> cell)) throw std::runtime_error(path + ": it has too few cells");
      map->setCell(i, j, cell == 0 ? 1.0f : cell == 100 ? 0.0f : 0.5f);
    }
  }
  auto & likelihood = map->likelihoodOptions;
  likelihood.likelihoodMethod = COccupancyGridMap2D::lmLikelihoodField_Thrun;
  likelihood.LF_decimation = 10;
  likelihood.LF_stdHit = 0.40f;
  likelihood.LF_maxCorrsDistance = 0.30f;
  likelihood.LF_zHit = 0.95f;
  likelihood.LF_zRandom = 0.05f;
  likelihood.LF_maxRange = 80.0f;
  likelihood.LF_alternateAverageMethod = false;
  return map;
}

std::vector<Reading> read_log(const std::string & path) {
  std::ifstream file(path);
  std::string line;
  std::string word;
  if (!std::getline(file, line)) throw std::runtime_error(path + ": no log");
  std::istringstream head(line);
  head >> word;
  const double x = number(head);
  const double y = number(head);
  const double heading = number(head);
  const double step = number(head);
  const double range_max = number(head);
  std::vector<Reading> readings;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    Reading reading;
    words >> reading.stamp;
    const double odometry_x = number(words);
    const double odometry_y = number(words);
    reading.odometry = CPose2D(odometry_x, odometry_y, number(words));
    reading.scan = CObservation2DRangeScan::Create();
    CObservation2DRangeScan & scan = *reading.scan;
    const size_t count = static_cast<size_t>(number(words));
    scan.resizeScan(count);
    scan.aperture = static_cast<float>(step * (count - 1));
    scan.rightToLeft = true;
    scan.maxRange = static_cast<float>(range_max);
    scan.sensorPose = mrpt::poses::CPose3D(x, y, 0.0, heading + 0.5 * scan.aperture, 0.0, 0.0);
    for (size_t k = 0; k < count; k++) {
      const double range = number(words);
      const bool met = range > 0.0 && range < range_max;
      scan.setScanRange(k, met ? static_cast<float>(range) : static_cast<float>(range_max));
      scan.setScanRangeValidity(k, met);
    }
    readings.push_back(reading);
  }
  return readings;
}

class Filter {
 public:
  Filter(COccupancyGridMap2D::Ptr map, unsigned particles) : map_(map), particles_(particles) {
    filter_.m_options.PF_algorithm = mrpt::bayes::CParticleFilter::pfStandardProposal;
    filter_.m_options.resamplingMethod = mrpt::bayes::CParticleFilter::prMultinomial;
    filter_.m_options.adaptiveSampleSize = true;
    filter_.m_options.BETA = 0.5;
    belief_.options.metricMap = map;
    auto & kld = belief_.options.KLD_params;
    kld.KLD_binSize_XY = 0.10f;
    kld.KLD_binSize_PHI = static_cast<float>(10.0 * M_PI / 180.0);
    kld.KLD_delta = 0.01f;
    kld.KLD_epsilon = 0.01f;
    kld.KLD_minSampleSize = std::min(150u, particles);
    kld.KLD_maxSampleSize = particles;
    kld.KLD_minSamplesPerBin = 0;
    motion_.modelSelection = CActionRobotMovement2D::mmGaussian;
    motion_.gaussianModel.minStdXY = 0.10;
    motion_.gaussianModel.minStdPHI = 2.0 * M_PI / 180.0;
  }

  void start_anywhere() { belief_.resetUniformFreeSpace(map_.get(), 0.7, static_cast<int>(particles_)); }

  void start_at(double x, double y, double heading) {
    auto & random = mrpt::random::getRandomGenerator();
    belief_.clear();
    belief_.m_particles.resize(std::min(2000u, particles_));
    for (auto & particle : belief_.m_particles) {
      particle.log_w = 0.0;
      particle.d.x = x + random.drawGaussian1D(0.0, 0.5);
      particle.d.y = y + random.drawGaussian1D(0.0, 0.5);
      particle.d.phi = mrpt::math::wrapToPi(heading + random.drawGaussian1D(0.0, M_PI / 12.0));
    }
  }

  std::tuple<mrpt::math::CMatrixDouble33, CPose2D> take(const CPose2D & moved, CObservation2DRangeScan::Ptr scan) {
    CActionRobotMovement2D movement;
    movement.computeFromOdometry(moved, motion_);
    mrpt::obs::CActionCollection actions;
    actions.insert(movement);
    mrpt::obs::CSensoryFrame frame;
    frame.insert(scan);
    filter_.executeOn(belief_, &actions, &frame);
    return belief_.getCovarianceAndMean();
  }

 private:
  COccupancyGridMap2D::Ptr map_;
  unsigned particles_;
  mrpt::bayes::CParticleFilter filter_;
  mrpt::slam::CMonteCarloLocalization2D belief_;
  CActionRobotMovement2D::TMotionModelOptions motion_;
};

int run(const std::vector<std::string> & arguments) {
  if (arguments.size() != 5) throw std::runtime_error("usage: mrpt_pf MAP LOG START SEED PARTICLES");
  const auto map = read_map(arguments[0]);
  const std::vector<Reading> readings = read_log(arguments[1]);
  const unsigned particles = arguments[4] == "default" ? 40000 : static_cast<unsigned>(std::stoul(arguments[4]));
  Filter filter(map, particles);
  mrpt::random::getRandomGenerator().randomize(static_cast<uint32_t>(std::stoul(arguments[3])));
  std::vector<std::string> lines;
  const auto began = std::chrono::steady_clock::now();
  if (arguments[2] == "anywhere") {
    filter.start_anywhere();
  } else {
    double x;
    double y;
    double heading;
    if (std::sscanf(arguments[2].c_str(), "%lf,%lf,%lf", &x, &y, &heading) != 3) {
      throw std::runtime_error("START is no x,y,heading: " + arguments[2]);
    }
    filter.start_at(x, y, heading);
  }
  CPose2D last = readings.at(0).odometry;
  for (const Reading & reading : readings) {
    const auto [covariance, pose] = filter.take(reading.odometry - last, reading.scan);
    last = reading.odometry;
    char line[256];
    std::snprintf(
      line, sizeof line, "%s %.9g %.9g %.9g %.9g %.9g %.9g %.9g", reading.stamp.c_str(), pose.x(), pose.y(), pose.phi(),
      covariance(0, 0), covariance(0, 1), covariance(1, 1), covariance(2, 2));
    lines.emplace_back(line);
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  for (const std::string & line : lines) std::puts(line.c_str());
  std::printf("updates %zu seconds %.6f\n", readings.size(), seconds);
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
