# build/release/bench/trees --peer build/trees_peer --csv build/trees.csv && gnuplot bench/trees.gp
set terminal svg size 720,420 font "sans,13" background "white"
set output "docs/trees.svg"
set datafile separator ","
set key left top
set logscale xy
set grid
set xlabel "nodes in the Sequence"
set ylabel "one tick, ns a node"
set yrange [1:1000]
plot "build/trees.csv" skip 1 using 1:3 with linespoints lw 2 pt 5 title "BehaviorTree.CPP 4.10.0", \
     "" skip 1 using 1:2 with linespoints lw 2 pt 7 title "Pons"
