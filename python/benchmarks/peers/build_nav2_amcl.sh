#!/usr/bin/env bash
# Compiles nav2_amcl.cpp beside this file with nav2_amcl's sources, and with what Nav2 compiles them with:
#   git clone https://github.com/ros-navigation/navigation2 && git -C navigation2 checkout a3a97043ee93
#   python/benchmarks/peers/build_nav2_amcl.sh navigation2/nav2_amcl OUT
# It needs gcc and g++, and neither ROS nor the network.
set -euo pipefail
sources=$1
out=$2
here=$(dirname "${BASH_SOURCE[0]}")
work=$(mktemp --directory)
trap 'rm -rf "$work"' EXIT

# The motion model registers itself as a plugin of ROS, for which nothing is needed here.
mkdir "$work/pluginlib"
printf '#define PLUGINLIB_EXPORT_CLASS(Derived, Base)\n' >"$work/pluginlib/class_list_macros.hpp"

flags=(-O3 -DNDEBUG -DHAVE_DRAND48 -I "$sources/include" -I "$work")
for name in pf pf_kdtree pf_pdf pf_vector eig3; do
    gcc -c "${flags[@]}" "$sources/src/pf/$name.c" -o "$work/$name.o"
done
gcc -c "${flags[@]}" "$sources/src/map/map.c" -o "$work/map.o"
g++ -std=c++17 "${flags[@]}" "$here/nav2_amcl.cpp" "$sources/src/map/map_cspace.cpp" \
    "$sources/src/motion_model/differential_motion_model.cpp" "$sources/src/sensors/laser/laser.cpp" \
    "$sources/src/sensors/laser/likelihood_field_model.cpp" \
    "$sources/src/sensors/laser/likelihood_field_model_prob.cpp" "$work"/*.o -o "$out"
