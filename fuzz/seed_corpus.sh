#!/usr/bin/env bash
# Makes the first corpus of each target from the files of other software in tests/conformance.
set -euo pipefail
cd "$(dirname "$0")"
others=../tests/conformance

seed() {
    local target=$1
    shift
    mkdir -p "corpus/$target"
    cp "$@" "corpus/$target/"
}

seed bag $others/mcap/*.mcap $others/rosbag2/mcap/*.mcap
seed sqlite $others/rosbag2/*/*.db3
for folder in $others/rosbag2/*/; do
    mkdir -p corpus/metadata
    cp "$folder/metadata.yaml" "corpus/metadata/$(basename "$folder").yaml"
done
seed scan_pcd $others/clouds/*.pcd
seed scan_ply $others/clouds/ply*.ply
seed scan_las $others/clouds/*.la[sz]
seed scan_depth ../crates/dmp-log/tests/fixtures/depth/*.png
seed world_las $others/clouds/*.la[sz]
seed cloud $others/clouds/*.pcd $others/clouds/*.ply $others/clouds/*.la[sz]
seed mesh $others/mesh/*.ply $others/mesh/*.obj $others/clouds/mesh*.ply $others/clouds/mesh*.obj
seed trajectory $others/trajectories/*.tum $others/trajectories/*.txt $others/trajectories/*.csv
seed npy $others/trajectories/*.npy
seed g2o $others/trajectories/*.g2o
seed pose_graph $others/trajectories/*.g2o
seed scan_times $others/trajectories/times.txt
seed loop_lists $others/trajectories/times.txt $others/trajectories/evo.tum
printf '0 0 1\n1 0 0 2\n0 1 0 0\n0 0 1 0\n0 0 0 1\n' > corpus/trajectory/redwood.log
printf 'secs,nsecs,x,y,z,qw,qx,qy,qz\n1,5,1,2,3,1,0,0,0\n' > corpus/trajectory/named.csv
mkdir -p corpus/scan_bin corpus/calib corpus/depth_list
head -c 1600 /dev/zero > corpus/scan_bin/zeros.bin
printf 'P0: 1 2\nTr: 0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3\n' > corpus/calib/calib.txt
printf 'from,to,label\n12,400,true\n400 12 YES # again\n3 90 0\n' > corpus/loop_lists/labels.csv
printf '# depth maps\n0.5 0.png\n1.5 1.5.png\n---\n{"width":2,"height":1,"intrinsic_matrix":[2,0,0,0,2,0,0.5,0,1],"depth_scale":1000}' \
    > corpus/depth_list/list.txt
