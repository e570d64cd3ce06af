"""Known vulnerabilities of the installed packages, by pip-audit: `make audit`, or with the options of pip-audit.

Ends with 1 if one is found. Where no database answers, such as behind a firewall, it says that nothing was audited and
ends with 0. So it does where a mirror of the package index answers but knows no package, which pip-audit alone would
take for packages without vulnerabilities.
"""

import json
import subprocess
import sys

DATABASES = [["--local", "--skip-editable", "--vulnerability-service", name] for name in ("pypi", "osv")]


def audit(options: list[str]) -> tuple[list[dict], str]:
    """The packages that the database knows, with their vulnerabilities; or none, and why."""
    command = [sys.executable, "-m", "pip_audit", "--format", "json", "--progress-spinner", "off", *options]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        packages = json.loads(ran.stdout)["dependencies"]
    except ValueError:
        return [], (ran.stderr.strip().splitlines() or ["no reason was given"])[-1]
    known = [package for package in packages if "vulns" in package]
    return known, "" if known else f"it knows none of {len(packages)} packages"


def main(databases: list[list[str]]) -> int:
    """Audit with the first database that answers."""
    for options in databases:
        known, reason = audit(options)
        if known:
            break
        print(f"pip-audit {' '.join(options)}: {reason}")
    else:
        print("NOT AUDITED: no vulnerability database answered. Repeat `make audit` where one can be reached.")
        return 0
    vulnerable = [package for package in known if package["vulns"]]
    for package in vulnerable:
        for one in package["vulns"]:
            fixed = ", ".join(one["fix_versions"]) or "no version"
            print(f"{package['name']} {package['version']}: {one['id']}, fixed in {fixed}")
    print(f"{len(known)} packages audited, {len(vulnerable)} with known vulnerabilities")
    return int(bool(vulnerable))


if __name__ == "__main__":
    sys.exit(main([sys.argv[1:]] if sys.argv[1:] else DATABASES))
