# The cost of the firmware against the real device's budget, from what test/cost.c printed and its linker map.
# Exit status 1: over budget.
BEGIN {
    budget_cycles = 7000 # 100 us at 70 MIPS
    budget_ram = 8192
    budget_flash = 65536
    printf "control interrupt, Cortex-M4F instructions   mean  worst   (the real device has %d cycles)\n", budget_cycles
}

# --- cost.txt: state, mean, worst
FILENAME ~ /txt$/ && $1 == "stack" { stack = 2 * $2 + 104; next } # the deepest tick on top of the deepest main loop, and the frame between
FILENAME ~ /txt$/ && $1 == "world" { world = $3; next }
FILENAME ~ /txt$/ {
    printf "  %-41s %6d %6d\n", $1, $2, $3
    if ($3 > worst)
        worst = $3
    next
}

# --- the map: section, address, size, object; a long name stands on a line of its own
/^ \.[a-zA-Z]/ && NF == 1 { section = $1; next }
/^ +\.?[a-zA-Z0-9._]* *0x[0-9a-f]+ +0x[0-9a-f]+ .*\/core\/[a-z]+\.o$/ {
    if (NF == 4)
        section = $1
    size = number($(NF - 1))
    if (section ~ /^\.(bss|data)/ || section == "COMMON")
        ram += size
    if (section ~ /^\.(text|rodata|data)/)
        flash += size
}

END {
    printf "  %-41s %6s %6d   (the simulated solenoid, not the firmware's)\n", "the world", "", world
    print "memory of the core, bytes"
    printf "  %-41s %13d   of %d\n", "flash: code and tables", flash, budget_flash
    printf "  %-41s %13d\n", "RAM: variables and buffers", ram
    printf "  %-41s %13d\n", "RAM: stack, main loop and tick", stack
    printf "  %-41s %13d   of %d\n", "RAM", ram + stack, budget_ram
    if (!(worst > 0 && flash > 0 && ram > 0 && stack > 0) ||
        worst > budget_cycles || flash > budget_flash || ram + stack > budget_ram) {
        print "over budget, or not measured"
        exit 1
    }
}

function number(hex,    value, k) {
    for (k = 3; k <= length(hex); k++)
        value = value * 16 + index("0123456789abcdef", substr(hex, k, 1)) - 1
    return value
}
